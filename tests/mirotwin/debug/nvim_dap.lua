-- Drives the adapter with nvim-dap: a breakpoint, steps both ways, variables. Called by test_nvim_dap.py, which opens
-- failsafe.c and gives the configuration of docs/howto/debug.md in CONFIGURATION.
local dap = require('dap')
local shown = false
dap.listeners.after.scopes.test = function() shown = true end

local function stop(move)
  shown = false
  move()
  assert(vim.wait(60000, function() return shown end), 'no stop')
  local frame = dap.session().current_frame
  return frame.name .. ':' .. frame.line
end

local function value(expression)
  local found
  dap.session():evaluate(expression, function(err, body) found = err and err.message or body.result end)
  assert(vim.wait(60000, function() return found end), 'no answer')
  return found
end

local function drive()
  assert(loadstring(os.getenv('CONFIGURATION')))()
  vim.api.nvim_win_set_cursor(0, { 146, 0 })
  dap.set_breakpoint('age >= 20')
  stop(dap.continue)
  assert(value('tick') == '0')
  assert(stop(dap.continue) == 'failsafe_tick:146')
  assert(vim.api.nvim_buf_get_name(0):match('failsafe.c$') and vim.fn.line('.') == 146)
  assert(tonumber(value('age'):match('^%d+')) >= 20)
  local scope = dap.session().current_frame.scopes[2]
  assert(vim.wait(60000, function() return scope.variables end) and scope.name == 'Statics of failsafe.c')
  assert(scope.variables.age.value:match('^%d+'))
  local tick = value('tick')
  local after = stop(dap.step_over)
  assert(after ~= 'failsafe_tick:146')
  assert(stop(dap.step_back) == 'failsafe_tick:146' and value('tick') == tick)
  assert(stop(dap.step_out):match('^main:'))
  assert(not stop(dap.step_into):match('^failsafe_tick:'))
  stop(dap.reverse_continue)
  assert(value('tick') == tick)
  assert(value('where'):match('failsafe.c:146 in failsafe_tick\n.*in main'))
  assert(value('no_such_name'):match('there is no no_such_name here'))
  dap.disconnect()
  assert(vim.wait(60000, function() return dap.session() == nil end), 'no end')
end

local good, err = pcall(drive)
io.stderr:write('\n' .. (good and 'done' or err) .. '\n')
vim.cmd(good and 'qall!' or 'cquit!')
