-- Starts the language server and switches inlay hints on.

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
local group = vim.api.nvim_create_augroup('mauve', {})

vim.api.nvim_create_autocmd('LspAttach', {
  group = group,
  callback = function(event)
    local client = vim.lsp.get_client_by_id(event.data.client_id)
    if client and client.name == 'mauve' and mauve.settings().inlay_hints ~= false then
      vim.lsp.inlay_hint.enable(true, { bufnr = event.buf })
    end
  end,
})

vim.api.nvim_create_autocmd('FileType', {
  group = group,
  pattern = { 'mauve', 'toml' },
  callback = function(event)
    mauve.attach(event.buf)
  end,
})

vim.api.nvim_create_user_command('Mauve', function(command)
  if command.args == 'restart' then
    mauve.restart()
  else
    vim.notify(('mauve: there is no ":Mauve %s", only ":Mauve restart"'):format(command.args), vim.log.levels.ERROR)
  end
end, {
  nargs = 1,
  desc = 'Restart the MAUVE language server',
  complete = function()
    return { 'restart' }
  end,
})

-- A colour scheme clears the links.
vim.api.nvim_create_autocmd('ColorScheme', { group = group, callback = colours.link })

colours.link()
mauve.start()
