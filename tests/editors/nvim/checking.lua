-- Checks that stop Neovim with a message where one fails.

local M = { folder = vim.env.MAUVE_TEST_FOLDER }

-- A slow machine takes long for a step, and no longer than this (ms). Where the server is not there, nothing comes.
local PATIENCE = vim.fn.executable(vim.env.MAUVE_TEST_SERVER) == 1 and 60000 or 5000

local current
local function fail(message)
  io.stderr:write(('\n%s:\n%s\nmessages:\n%s\n'):format(current, message, vim.fn.execute('messages')))
  vim.cmd('cquit 1')
end

--- Runs one check. An error in it is its failure.
function M.check(name, body)
  current = name
  local ok, message = xpcall(body, debug.traceback)
  if not ok then
    fail(message)
  end
end

function M.equal(expected, seen, about)
  if not vim.deep_equal(expected, seen) then
    fail(('expected: %s\nseen:     %s\n%s'):format(
      vim.inspect(expected),
      vim.inspect(seen),
      debug.traceback(about and 'of: ' .. about or '', 2)
    ))
  end
end

--- Waits until `look` returns a value that `accept` accepts, and returns it. The screen is drawn, so that what is only
--- there when it is drawn can be seen.
---@param expected string  what is waited for, in words
function M.wait(expected, look, accept)
  local seen
  local met = vim.wait(PATIENCE, function()
    vim.cmd.redraw()
    seen = look()
    return accept(seen) and true or false
  end, 20)
  if not met then
    fail(('expected: %s\nseen:     %s\n%s'):format(expected, vim.inspect(seen), debug.traceback('', 2)))
  end
  return seen
end

--- Puts the cursor of the current window at the first occurrence of a text.
function M.put_cursor(text)
  local lines = vim.api.nvim_buf_get_lines(0, 0, -1, false)
  for number, line in ipairs(lines) do
    local column = line:find(text, 1, true)
    if column then
      vim.api.nvim_win_set_cursor(0, { number, column - 1 })
      return
    end
  end
  error(('no line has "%s":\n%s'):format(text, table.concat(lines, '\n')))
end

function M.done()
  vim.cmd('qall!')
end

return M
