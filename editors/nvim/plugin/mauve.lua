-- Starts the language server and draws its figures.

if vim.g.loaded_mauve then
  return
end
vim.g.loaded_mauve = true

if vim.fn.has('nvim-0.10') == 0 then
  vim.notify('mauve: the language server needs Neovim 0.10 or later', vim.log.levels.WARN)
  return
end

local mauve = require('mauve')
local colours = require('mauve.colours')
local figures = require('mauve.figures')
local group = vim.api.nvim_create_augroup('mauve', {})

vim.api.nvim_create_autocmd('LspAttach', {
  group = group,
  callback = function(event)
    local client = vim.lsp.get_client_by_id(event.data.client_id)
    if not client or client.name ~= 'mauve' then
      return
    end
    -- The server formats models alone: elsewhere, `gq` would do nothing.
    if vim.bo[event.buf].filetype ~= 'mauve' and #vim.lsp.get_clients({ bufnr = event.buf }) == 1 then
      vim.bo[event.buf].formatexpr = nil
    end
    if mauve.settings().inlay_hints ~= false then
      figures.attach(client, event.buf)
    end
    if mauve.settings().code_lens then
      mauve.show_lenses(event.buf, group)
    end
  end,
})

vim.api.nvim_create_autocmd('LspDetach', {
  group = group,
  callback = function(event)
    local client = vim.lsp.get_client_by_id(event.data.client_id)
    if client and client.name == 'mauve' then
      figures.detach(event.buf)
    end
  end,
})

vim.api.nvim_create_autocmd({ 'WinResized', 'BufWinEnter' }, { group = group, callback = figures.redraw })
vim.api.nvim_create_autocmd('FocusGained', { group = group, callback = mauve.focused })
vim.api.nvim_create_autocmd('OptionSet', { group = group, pattern = 'wrap', callback = figures.redraw })

-- The diagnostics come with each analysis, also with one of another file.
vim.api.nvim_create_autocmd({ 'TextChanged', 'TextChangedI', 'TextChangedP', 'DiagnosticChanged', 'WinResized' }, {
  group = group,
  callback = function(event)
    -- A buffer that is being wiped out has no options.
    local is_ours = event.event == 'WinResized' or vim.api.nvim_buf_is_loaded(event.buf)
      and vim.list_contains(mauve.filetypes, vim.bo[event.buf].filetype)
    if package.loaded['mauve.drawings'] and is_ours then
      require('mauve.drawings').update()
    end
    -- Diagnostics that stay may come without an event.
    if is_ours or event.event == 'DiagnosticChanged' then
      mauve.update_verdict()
    end
  end,
})

vim.api.nvim_create_autocmd({ 'CursorMoved', 'CursorMovedI' }, {
  group = group,
  callback = function(event)
    if package.loaded['mauve.drawings'] and vim.bo[event.buf].filetype == 'mauve' then
      require('mauve.drawings').light()
    end
  end,
})

vim.api.nvim_create_autocmd('FileType', {
  group = group,
  pattern = mauve.filetypes,
  callback = function(event)
    mauve.attach(event.buf)
  end,
})

local commands = {
  generate = function(deployment)
    require('mauve.generate').run(deployment)
  end,
  problems = mauve.clicked,
  reload = mauve.reload,
  restart = mauve.restart,
  significance = mauve.choose_significance,
}
for _, kind in ipairs({ 'chains', 'graph', 'machine', 'probability', 'schedule', 'times', 'tree' }) do
  commands[kind] = function(where)
    require('mauve.drawings').show(kind, where)
  end
end

commands.whatif = function(...)
  require('mauve.drawings').what_if({ ... })
end

for _, name in ipairs({ 'measure', 'pwcet', 'run', 'trace' }) do
  commands[name] = function(...)
    require('mauve.terminal').run(name, { ... })
  end
end

vim.api.nvim_create_user_command('Mauve', function(command)
  local name = command.fargs[1]
  if commands[name] then
    commands[name](unpack(command.fargs, 2))
  else
    local known = table.concat(vim.tbl_keys(commands), ', ')
    vim.notify(('mauve: no command "%s"; there are: %s'):format(name, known), vim.log.levels.ERROR)
  end
end, {
  nargs = '+',
  desc = 'Commands of the MAUVE language server',
  complete = function(lead, line)
    local known = vim.tbl_keys(commands)
    if line:find('Mauve%s+generate%s') then
      known = require('mauve.generate').deployments()
    elseif line:find('Mauve%s+%a+%s') and require('mauve.drawings').kinds[line:match('Mauve%s+(%a+)%s')] then
      known = { 'split', 'float', 'browser' }
    elseif line:find('Mauve%s+%S+%s') then
      local words = require('mauve.terminal').commands[line:match('Mauve%s+(%S+)')]
      local is_first = line:find('^%s*%S+%s+%S+%s+%S*$')
      known = words and (is_first and #words > 0 and words or vim.fn.getcompletion(lead, 'file')) or {}
    end
    return vim.tbl_filter(function(name)
      return vim.startswith(name, lead)
    end, known)
  end,
})

-- A colour scheme clears the links.
local function link()
  colours.link()
  figures.link()
end
vim.api.nvim_create_autocmd('ColorScheme', { group = group, callback = link })

link()
mauve.start()
