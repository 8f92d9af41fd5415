// Stands in for VS Code: loads the extension, begins one debug session, and prints what came of it as JSON.
// Called by test_vsix.py: node extension_host.js EXTENSION FOLDER SETTING ANSWER CONFIGURATION
const { spawn } = require('node:child_process');
const Module = require('node:module');

const [extension, root, setting, answer, text] = process.argv.slice(2);
const folder = root ? { uri: { fsPath: root } } : undefined;
const seen = { messages: [], commands: [] };
const registered = {};
const vscode = {
  workspace: { getConfiguration: (section) => ({ get: (key, other) => (section === 'mirotwin' && key === 'path' ? setting : other) }) },
  window: {
    showErrorMessage: async (message, ...items) => {
      seen.messages.push([message, ...items]);
      return answer || undefined;
    },
  },
  commands: { executeCommand: async (...words) => seen.commands.push(words) },
  debug: {
    registerDebugConfigurationProvider: (type, provider) => (registered[type] = { ...registered[type], provider }),
    registerDebugAdapterDescriptorFactory: (type, factory) => (registered[type] = { ...registered[type], factory }),
  },
  DebugAdapterExecutable: class {
    constructor(command, args, options) {
      Object.assign(this, { command, args, options });
    }
  },
};
const load = Module._load;
Module._load = (name, ...more) => (name === 'vscode' ? vscode : load(name, ...more));

// The adapter's answers to these requests.
function talk({ command, args, options }, requests) {
  const adapter = spawn(command, args, { ...options, stdio: ['pipe', 'pipe', 'inherit'] });
  let data = Buffer.alloc(0);
  const answers = [];
  return new Promise((done) => {
    const send = (number) => {
      const body = JSON.stringify({ seq: number + 1, type: 'request', ...requests[number] });
      adapter.stdin.write(`Content-Length: ${Buffer.byteLength(body)}\r\n\r\n${body}`);
    };
    adapter.stdout.on('data', (chunk) => {
      data = Buffer.concat([data, chunk]);
      for (let head; (head = /^Content-Length: (\d+)\r\n\r\n/.exec(data.toString('latin1'))) !== null; ) {
        const end = head[0].length + Number(head[1]);
        if (data.length < end) return;
        const message = JSON.parse(data.subarray(head[0].length, end));
        data = data.subarray(end);
        if (message.type === 'response') {
          answers.push(message);
          if (answers.length < requests.length) send(answers.length);
        }
      }
    });
    adapter.on('exit', (code) => done({ answers, code }));
    send(0);
  });
}

async function main() {
  const context = { subscriptions: [] };
  require(extension).activate(context);
  const { provider, factory } = registered.mirotwin;
  const configuration = provider.resolveDebugConfiguration(folder, JSON.parse(text));
  seen.configuration = configuration === undefined ? 'ended' : configuration;
  await new Promise(setImmediate);
  if (configuration && configuration.debugServer === undefined) {
    const found = factory.createDebugAdapterDescriptor({ workspaceFolder: folder, configuration });
    Object.assign(seen, found, await talk(found, [
      { command: 'initialize', arguments: { adapterID: 'mirotwin' } },
      { command: 'launch', arguments: configuration },
      { command: 'disconnect' },
    ]));
  }
  console.log(JSON.stringify({ ...seen, subscriptions: context.subscriptions.length }));
}

main();
