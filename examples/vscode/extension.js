// Starts `mirotwin debug --dap` for a debug session, and says where the program was looked for when it is not there.
'use strict';

const fs = require('fs');
const os = require('os');
const path = require('path');
const vscode = require('vscode');

const SETTING = 'mirotwin.path';
const WINDOWS = process.platform === 'win32';

function isProgram(file) {
  try {
    fs.accessSync(file, fs.constants.X_OK);
    return fs.statSync(file).isFile();
  } catch {
    return false;
  }
}

// The files that a name may mean: itself, on Windows also with the endings of programs.
function candidates(file) {
  return WINDOWS && !path.extname(file) ? [`${file}.exe`, `${file}.cmd`, `${file}.bat`] : [file];
}

// Where the program may be, in this order: the setting, or else the environment .venv of the folder, then PATH.
function places(folder) {
  const root = folder ? folder.uri.fsPath : '';
  const given = vscode.workspace.getConfiguration('mirotwin', folder ? folder.uri : undefined).get('path', '').trim();
  if (given) {
    const file = given.replaceAll('${workspaceFolder}', root).replace(/^~(?=[\\/])/, os.homedir());
    return path.isAbsolute(file) || /[\\/]/.test(file) ? [path.resolve(root, file)] : onPath(file);
  }
  const own = root ? [path.join(root, '.venv', WINDOWS ? 'Scripts' : 'bin', 'mirotwin')] : [];
  return [...own, ...onPath('mirotwin')];
}

function onPath(name) {
  return (process.env.PATH || '').split(path.delimiter).filter(Boolean).map((folder) => path.join(folder, name));
}

// The program's path, or undefined.
function find(folder) {
  return places(folder).flatMap(candidates).find(isProgram);
}

async function sayMissing(folder) {
  const given = vscode.workspace.getConfiguration('mirotwin', folder ? folder.uri : undefined).get('path', '').trim();
  const where = given ? `${SETTING} is ${given}, and no program is there` : 'it is neither in .venv of this folder nor on the PATH';
  const open = 'Open Settings';
  const text = `Mirotwin cannot start: ${where}. Set ${SETTING} to the mirotwin of the environment in which it is installed.`;
  if ((await vscode.window.showErrorMessage(text, open)) === open) {
    await vscode.commands.executeCommand('workbench.action.openSettings', SETTING);
  }
}

const configurations = {
  // Before any task of the session runs. undefined ends the session, null opens launch.json.
  resolveDebugConfiguration(folder, configuration) {
    if (!configuration.type) {
      return null;
    }
    if (configuration.debugServer === undefined && find(folder) === undefined) {
      sayMissing(folder);
      return undefined;
    }
    return configuration;
  },
};

const adapters = {
  createDebugAdapterDescriptor(session) {
    const folder = session.workspaceFolder;
    const program = find(folder);
    if (program === undefined) {
      throw new Error(`mirotwin is not there; set ${SETTING}`);
    }
    const options = folder ? { cwd: folder.uri.fsPath } : undefined;
    return new vscode.DebugAdapterExecutable(program, ['debug', '--dap'], options);
  },
};

function activate(context) {
  context.subscriptions.push(
    vscode.debug.registerDebugConfigurationProvider('mirotwin', configurations),
    vscode.debug.registerDebugAdapterDescriptorFactory('mirotwin', adapters),
  );
}

module.exports = { activate, deactivate() {} };
