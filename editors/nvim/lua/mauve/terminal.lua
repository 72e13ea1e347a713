-- Commands of the command line that take long, in a terminal below: `:Mauve run`, `:Mauve trace`, `:Mauve measure`, `:Mauve pwcet`.

local mauve = require('mauve')

local M = {}

--- The commands, and the words by which they are continued.
M.commands = { measure = {}, pwcet = {}, run = {}, trace = { 'check', 'export', 'import' } }

--- The `mauve.toml` of the current buffer, or of the drawing in it; otherwise the file itself.
local function project()
  local buffer = vim.api.nvim_get_current_buf()
  if package.loaded['mauve.drawings'] then
    buffer = require('mauve.drawings').source(buffer)
  end
  local root = vim.fs.root(buffer, 'mauve.toml')
  return root and vim.fs.joinpath(root, 'mauve.toml') or vim.api.nvim_buf_get_name(buffer)
end

--- Runs a command with these arguments. One that needs a model gets that of the current buffer.
---@param command string
---@param arguments string[]
function M.run(command, arguments)
  local line = vim.list_extend({ (mauve.program()), command }, arguments)
  if command == 'run' or command == 'trace' and arguments[1] == 'check' then
    table.insert(line, project())
  end
  vim.cmd(('botright %dnew'):format(math.max(8, math.floor(vim.o.lines / 3))))
  local buffer = vim.api.nvim_get_current_buf()
  local function ended(_, code)
    -- Tables that it has written.
    vim.cmd('silent! checktime')
    local what = ({ [0] = 'ended', 'ended with findings' })[code] or 'failed'
    vim.notify(('mauve %s %s (exit code %d)'):format(command, what, code))
  end
  if vim.fn.has('nvim-0.11') == 1 then
    vim.fn.jobstart(line, { term = true, on_exit = ended })
  else
    vim.fn.termopen(line, { on_exit = ended })
  end
  vim.bo[buffer].bufhidden = 'wipe'
  vim.keymap.set('n', 'q', '<Cmd>close<CR>', { buffer = buffer, nowait = true, desc = 'End the command' })
  -- The last line stays in sight.
  vim.cmd('normal! G')
end

return M
