-- The language server, for `vim.lsp.config` (Neovim 0.11 and later) and `vim.lsp.start` (0.10).

local mauve = require('mauve')
local colours = require('mauve.colours')
local figures = require('mauve.figures')
local generate = require('mauve.generate')

return {
  name = 'mauve',
  cmd = mauve.command(),
  -- The server follows what mauve.toml names while it is edited: response times change with it.
  filetypes = mauve.filetypes,

  root_dir = function(buffer, start)
    local project = vim.fs.root(buffer, 'mauve.toml')
    if project then
      start(project)
    elseif vim.bo[buffer].filetype == 'mauve' then
      start(vim.fs.root(buffer, '.git'))
    end
  end,

  before_init = function(params)
    colours.extend(params.capabilities)
    generate.extend(params.capabilities)
  end,

  -- From code actions and lenses.
  commands = {
    [generate.COMMAND] = generate.execute,
  },

  handlers = {
    ['workspace/inlayHint/refresh'] = function(_, _, context)
      figures.update(vim.lsp.get_client_by_id(context.client_id))
      mauve.update_verdict()
      return vim.NIL
    end,
  },

  -- The plugin draws the hints itself. Where the user has switched inlay hints on for all servers, they would be there twice.
  on_init = function(client)
    client.server_capabilities.inlayHintProvider = nil
  end,
}
