-- The plugin that `mauve editor install nvim` installed, in a Neovim without options: run by ./run on a clean home, with a model
-- opened from the command line.

local checking = dofile(vim.fs.joinpath(vim.fs.dirname(debug.getinfo(1, 'S').source:sub(2)), 'checking.lua'))
local check, equal, wait = checking.check, checking.equal, checking.wait

check('the server is attached, and figures are drawn', function()
  local clients = wait('a client', function()
    return vim.lsp.get_clients({ bufnr = 0, name = 'mauve' })
  end, function(seen)
    return #seen == 1
  end)
  equal({ vim.env.MAUVE_TEST_SERVER, 'lsp' }, clients[1].config.cmd)
  wait('a response time', function()
    local namespace = vim.api.nvim_get_namespaces()['mauve.figures']
    return namespace and vim.inspect(vim.api.nvim_buf_get_extmarks(0, namespace, 0, -1, { details = true })) or ''
  end, function(seen)
    return seen:find('! 997 / 1000', 1, true)
  end)
end)

check('the help has its tags', function()
  local tags = vim.api.nvim_get_runtime_file('doc/tags', true)
  tags = vim.tbl_filter(function(path)
    return path:find('/pack/mauve/', 1, true)
  end, tags)[1]
  local before = vim.fn.readfile(tags)
  vim.cmd('silent help g:mauve')
  equal('mauve.txt', vim.fs.basename(vim.api.nvim_buf_get_name(0)))
  vim.cmd('helptags ' .. vim.fs.dirname(tags))
  equal(before, vim.fn.readfile(tags))
end)

checking.done()
