-- The plugin as a user has it: on the runtime path, with the server's path in the settings.
vim.opt.runtimepath:prepend(vim.env.MAUVE_TEST_PLUGIN)
vim.g.mauve = { server = { path = vim.env.MAUVE_TEST_SERVER } }

-- The script that checks it, when Neovim is ready for its user. An error leaves it, as nobody is there to see one.
if vim.env.MAUVE_TEST_SCRIPT then
  vim.api.nvim_create_autocmd('VimEnter', {
    callback = vim.schedule_wrap(function()
      local ok, message = xpcall(dofile, debug.traceback, vim.env.MAUVE_TEST_SCRIPT)
      if not ok then
        io.stderr:write(message, '\n')
        vim.cmd('cquit 1')
      end
    end),
  })
end
