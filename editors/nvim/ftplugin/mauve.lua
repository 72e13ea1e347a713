if vim.b.did_ftplugin then
  return
end
vim.b.did_ftplugin = true

local set = vim.opt_local

set.commentstring = '// %s'
set.comments = { 's1:/*', 'mb:*', 'ex:*/', '://' }
-- A comment goes on in the next line; program text is not broken.
set.formatoptions:remove('t')
set.formatoptions:append('croql')

-- `gf`, `[i` and the like: an included file is beside the one that includes it, or in a folder of MAUVE_MODELS.
set.include = [[^\s*include\s]]
set.define = [[^\s*\%(library\|codel\|shell\|core\|component\|architecture\|deployment\|state\|instance\)\s]]
set.suffixesadd = '.mal'
vim.bo.path = '.,' .. table.concat(vim.split(vim.env.MAUVE_MODELS or '', ':', { trimempty = true }), ',')

set.expandtab = true
set.shiftwidth = 2
set.softtabstop = 2

vim.b.undo_ftplugin = 'setlocal commentstring< comments< formatoptions< include< define< suffixesadd< path< '
  .. 'expandtab< shiftwidth< softtabstop<'
