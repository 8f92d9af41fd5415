// Drives the real adapter with @vscode/debugadapter-testsupport: each request that the capabilities announce is used and judged.
// Called by test_editors.py: node dap_client.js PYTHON SERVER SOURCES
const assert = require('node:assert');
const path = require('node:path');
const { DebugClient } = require('@vscode/debugadapter-testsupport');

const [python, server, sources] = process.argv.slice(2);
const client = new DebugClient(python, server, 'mirotwin');
const failsafe = path.join(sources, 'failsafe.c');
const used = new Set();
const thread = { threadId: 1 };

async function stop(request, reason) {
  const stopped = client.waitForEvent('stopped', 60000);
  await request;
  const { body } = await stopped;
  assert.strictEqual(body.reason, reason, JSON.stringify(body));
  const { body: trace } = await client.stackTraceRequest(thread);
  return trace.stackFrames;
}

async function value(expression, frameId, context = 'watch') {
  return (await client.evaluateRequest({ expression, frameId, context })).body.result;
}

async function breakpoints(...lines) {
  const { body } = await client.setBreakpointsRequest({ source: { path: failsafe }, breakpoints: lines });
  return body.breakpoints;
}

async function main() {
  await client.start();
  const { body: capabilities } = await client.initializeRequest();
  const initialized = client.waitForEvent('initialized', 60000);
  await client.launchRequest({ subject: 'fig6', seed: 3, stopOnEntry: true });
  await initialized;

  // conditional, hit-count and function breakpoints, log points
  let [set] = await breakpoints({ line: 146, condition: 'age >= 20' });
  assert.ok(set.verified && set.line === 146);
  [set] = await breakpoints({ line: 1 });
  assert.ok(set.verified && set.line > 1 && set.message.includes('no code'));
  await breakpoints({ line: 146, condition: 'age >= 20' });
  let frames = await stop(client.configurationDoneRequest(), 'entry');
  used.add('ConfigurationDoneRequest');
  frames = await stop(client.continueRequest(thread), 'breakpoint');
  assert.strictEqual(frames[0].line, 146);
  assert.strictEqual(frames[0].source.path, failsafe);
  assert.ok(parseInt(await value('age', frames[0].id)) >= 20);
  used.add('ConditionalBreakpoints');
  await breakpoints({ line: 146, hitCondition: '25' });
  frames = await stop(client.continueRequest(thread), 'breakpoint');
  const hits = await value('tick', frames[0].id);
  await breakpoints({ line: 146 });
  for (let at = 0; at < 24; at += 1) await stop(client.reverseContinueRequest(thread), 'breakpoint');
  await stop(client.reverseContinueRequest(thread), 'pause');
  await breakpoints({ line: 146, hitCondition: '25' });
  frames = await stop(client.continueRequest(thread), 'breakpoint');
  assert.strictEqual(await value('tick', frames[0].id), hits);
  used.add('HitConditionalBreakpoints');
  await breakpoints();
  await client.setFunctionBreakpointsRequest({ breakpoints: [{ name: 'failsafe_fresh' }] });
  const output = client.waitForEvent('output', 60000);
  await breakpoints({ line: 146, logMessage: 'age is {age}' });
  frames = await stop(client.continueRequest(thread), 'function breakpoint');
  assert.strictEqual(frames[0].name, 'failsafe_fresh');
  assert.strictEqual(frames[1].name, 'main');
  const told = (await output).body;
  assert.match(told.output, /^\d+\.\d+s {2}age is \d+/);
  assert.strictEqual(told.line, 146);
  used.add('FunctionBreakpoints').add('LogPoints');
  await client.setFunctionBreakpointsRequest({ breakpoints: [] });
  await breakpoints();

  // steps, also back, by line and by instruction
  const before = await value('tick', frames[0].id);
  const line = frames[0].line;
  frames = await stop(client.nextRequest(thread), 'step');
  assert.notStrictEqual(frames[0].line, line);
  frames = await stop(client.stepBackRequest(thread), 'step');
  assert.strictEqual(await value('tick', frames[0].id), before);
  used.add('StepBack');
  frames = await stop(client.nextRequest({ ...thread, granularity: 'instruction' }), 'step');
  assert.notStrictEqual(await value('PC', frames[0].id), await value('failsafe_fresh', frames[0].id));
  frames = await stop(client.stepBackRequest({ ...thread, granularity: 'instruction' }), 'step');
  assert.strictEqual(await value('tick', frames[0].id), before);
  used.add('SteppingGranularity');
  frames = await stop(client.stepOutRequest(thread), 'step');
  assert.strictEqual(frames[0].name, 'main');
  frames = await stop(client.stepInRequest(thread), 'step');

  // scopes, variables, memory, disassembly, hover, completion
  const { body: scopes } = await client.scopesRequest({ frameId: frames[0].id });
  const names = scopes.scopes.map((scope) => scope.name);
  for (const name of ['Locals', 'Globals', 'Registers', 'Special function registers', 'LM629 left', 'LM629 right', 'Pins', 'Radio']) assert.ok(names.includes(name), name);
  const all = {};
  for (const scope of scopes.scopes) all[scope.name] = (await client.variablesRequest({ variablesReference: scope.variablesReference })).body.variables;
  assert.ok(all['Radio'].length > 0 && all['LM629 left'].some((one) => one.name === 'real_position'));
  const scon = all['Special function registers'].find((one) => one.name === 'SCON');
  const bits = (await client.variablesRequest({ variablesReference: scon.variablesReference })).body.variables;
  assert.deepStrictEqual(bits.map((one) => one.name), ['RI', 'TI', 'RB8', 'TB8', 'REN', 'SM2', 'SM1', 'SM0']);
  const accepted = all['Globals'].find((one) => one.name === 'frames_accepted');
  const { body: memory } = await client.customRequest('readMemory', { memoryReference: accepted.memoryReference, count: 2 });
  const bytes = Buffer.from(memory.data, 'base64');
  assert.strictEqual(bytes.readUInt16LE(), parseInt(accepted.value));
  used.add('ReadMemoryRequest');
  const { body: listing } = await client.disassembleRequest({ memoryReference: frames[0].instructionPointerReference, instructionOffset: -3, instructionCount: 8 });
  assert.strictEqual(listing.instructions.length, 8);
  assert.strictEqual(listing.instructions[3].address, frames[0].instructionPointerReference);
  used.add('DisassembleRequest');
  assert.match(await value('frames_accepted', frames[0].id, 'hover'), /^\d+/);
  await assert.rejects(value('no_such_name', frames[0].id, 'hover'));
  used.add('EvaluateForHovers');
  const { body: completions } = await client.completionsRequest({ text: 'print frames_acc', column: 17, frameId: frames[0].id });
  assert.ok(completions.targets.some((one) => one.label === 'frames_accepted'));
  used.add('CompletionsRequest');

  // data breakpoints in both directions, instruction breakpoints
  const { body: info } = await client.dataBreakpointInfoRequest({ name: 'age', frameId: frames[0].id });
  await client.setDataBreakpointsRequest({ breakpoints: [{ dataId: info.dataId, accessType: 'write' }] });
  frames = await stop(client.reverseContinueRequest(thread), 'data breakpoint');
  const written = await value('tick', frames[0].id);
  frames = await stop(client.continueRequest(thread), 'data breakpoint');
  frames = await stop(client.reverseContinueRequest(thread), 'data breakpoint');
  assert.strictEqual(await value('tick', frames[0].id), written);
  await client.setDataBreakpointsRequest({ breakpoints: [] });
  used.add('DataBreakpoints');
  const at = frames[0].instructionPointerReference;
  await client.customRequest('setInstructionBreakpoints', { breakpoints: [{ instructionReference: at }] });
  frames = await stop(client.continueRequest(thread), 'instruction breakpoint');
  assert.strictEqual(frames[0].instructionPointerReference, at);
  await client.customRequest('setInstructionBreakpoints', { breakpoints: [] });
  used.add('InstructionBreakpoints');

  // a line of output is a moment: the console's goto
  const moved = client.waitForEvent('stopped', 60000);
  await value(`goto ${told.output.split(' ')[0]}`, frames[0].id, 'repl');
  assert.strictEqual((await moved).body.reason, 'goto');
  ({ body: { stackFrames: frames } } = await client.stackTraceRequest(thread));
  assert.strictEqual(frames[0].line, 146);
  assert.match(await value('who age', frames[0].id, 'repl'), /failsafe\.c:\d+/);

  // requests during a run, a pause, the end
  const end = client.waitForEvent('stopped', 60000);
  await client.continueRequest(thread);
  await client.threadsRequest();
  await client.pauseRequest(thread);
  assert.strictEqual((await end).body.reason, 'pause');
  await assert.rejects(client.customRequest('restartFrame', { frameId: 1 }));

  // lines with code, on to a line, no exception here, from the start again with the same breakpoints
  const { body: lines } = await client.customRequest('breakpointLocations', { source: { path: failsafe }, line: 140, endLine: 150 });
  assert.ok(lines.breakpoints.length > 3 && lines.breakpoints.every((one) => one.line >= 140 && one.line <= 150));
  used.add('BreakpointLocationsRequest');
  const { body: targets } = await client.customRequest('gotoTargets', { source: { path: failsafe }, line: 146 });
  frames = await stop(client.customRequest('goto', { ...thread, targetId: targets.targets[0].id }), 'goto');
  assert.strictEqual(frames[0].line, 146);
  used.add('GotoTargetsRequest');
  await client.setExceptionBreakpointsRequest({ filters: capabilities.exceptionBreakpointFilters.map((one) => one.filter) });
  await assert.rejects(client.customRequest('exceptionInfo', thread));
  used.add('ExceptionInfoRequest');
  [set] = await breakpoints({ line: 146 });
  const changed = client.waitForEvent('breakpoint', 60000);
  await stop(client.customRequest('restart', {}), 'entry');
  assert.strictEqual((await changed).body.breakpoint.id, set.id);
  frames = await stop(client.continueRequest(thread), 'breakpoint');
  assert.strictEqual(frames[0].line, 146);
  await breakpoints();
  used.add('RestartRequest');
  await assert.rejects(client.setVariableRequest({ variablesReference: 1, name: 'x', value: '1' })); // a robot has no parts
  used.add('SetVariable');
  const terminated = client.waitForEvent('terminated', 60000);
  await client.terminateRequest();
  used.add('TerminateRequest');
  await terminated;
  await client.disconnectRequest();

  const announced = Object.keys(capabilities).filter((key) => key.startsWith('supports') && capabilities[key]).map((key) => key.replace('supports', ''));
  assert.deepStrictEqual([...used].sort(), announced.sort());
}

process.exitCode = 1; // where the adapter ends, nothing is left to wait for
main().then(() => process.exit(0), (error) => { console.error(error); process.exit(1); });
