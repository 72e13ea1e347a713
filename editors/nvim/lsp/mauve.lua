-- The language server, for `vim.lsp.config` (Neovim 0.11 and later) and `vim.lsp.start` (0.10).

local mauve = require('mauve')
local colours = require('mauve.colours')
local generate = require('mauve.generate')

return {
  name = 'mauve',
  cmd = mauve.command(),
  -- The server follows mauve.toml and timing tables while they are edited: response times change with them.
  filetypes = { 'mauve', 'toml' },

  root_dir = function(buffer, start)
    local project = vim.fs.root(buffer, 'mauve.toml')
    if project then
      start(project)
    elseif vim.bo[buffer].filetype ~= 'toml' then
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
    -- Hints change without their buffer when another one does, such as a timing table. Neovim then asks for new hints
    -- in windows only, so that a buffer which is shown again later keeps the old ones; and 0.10 does not draw what it
    -- gets, as the buffer has no new version. Switching hints on anew does both, and the old ones stay until then.
    ['workspace/inlayHint/refresh'] = function(_, _, context)
      for buffer in pairs(vim.lsp.get_client_by_id(context.client_id).attached_buffers) do
        if vim.lsp.inlay_hint.is_enabled({ bufnr = buffer }) then
          vim.lsp.inlay_hint.enable(true, { bufnr = buffer })
        end
      end
      return vim.NIL
    end,
  },
}
