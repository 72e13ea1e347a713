-- Orocos packages from Neovim, on a copy of the sample robot: with the plugin, and by a plain client. Run by ./run.

local checking = dofile(vim.fs.joinpath(vim.fs.dirname(debug.getinfo(1, 'S').source:sub(2)), 'checking.lua'))
local check, equal, wait = checking.check, checking.equal, checking.wait
local put_cursor = checking.put_cursor

local function in_robot(path)
  return vim.fs.joinpath(checking.folder, path)
end

local function open(path)
  vim.cmd.edit(in_robot(path))
  return vim.api.nvim_get_current_buf()
end

local function read(path)
  local file = io.open(in_robot(path), 'rb')
  local text = file and file:read('*a')
  if file then
    file:close()
  end
  return text
end

local function write(path, text)
  vim.fn.mkdir(vim.fs.dirname(in_robot(path)), 'p')
  local file = assert(io.open(in_robot(path), 'wb'))
  file:write(text)
  file:close()
end

--- Replaces a text in the current buffer.
local function replace(old, new)
  for number, line in ipairs(vim.api.nvim_buf_get_lines(0, 0, -1, false)) do
    local first, last = line:find(old, 1, true)
    if first then
      vim.api.nvim_buf_set_text(0, number - 1, first - 1, number - 1, last, { new })
      return
    end
  end
  error('no ' .. old)
end

--- What the command line says of the packages: its exit code, and its words.
local function checked(folder)
  local command = { vim.env.MAUVE_TEST_SERVER, 'generate', '--check', '--out', 'generated' }
  local result = vim.system(command, { cwd = folder, text = true }):wait()
  return result.code, result.stdout .. result.stderr
end

-- What the user is asked, and answers; what he is told.

local answers, previews, told = {}, {}, {}
vim.ui.select = function(items, options, choose)
  if options.kind == 'mauve.generate' then
    table.insert(previews, vim.api.nvim_buf_get_lines(0, 0, -1, false))
    equal({ 'Generate', 'Cancel' }, items)
    equal('diff', vim.bo.filetype)
    choose(table.remove(answers, 1))
    return
  end
  for _, item in ipairs(items) do
    if item.action and vim.startswith(item.action.title, 'Generate Orocos packages of') then
      choose(item)
      return
    end
  end
  error('no action that generates: ' .. vim.inspect(items))
end
vim.notify = function(message)
  table.insert(told, message)
end

local function wait_for_word(text)
  return wait('to be told ' .. text, function()
    return told
  end, function(seen)
    return #seen > 0 and seen[#seen]:find(text, 1, true)
  end)
end

local function has(lines, text)
  return vim.iter(lines):any(function(line)
    return line:find(text, 1, true) ~= nil
  end)
end

local deployment
local windows = #vim.api.nvim_list_wins()

--- Opens a model, and waits for the server to know it: Neovim 0.12 attaches a client later.
local function open_model(path)
  local buffer = open(path)
  wait('a client', function()
    return vim.lsp.get_clients({ bufnr = buffer, name = 'mauve' })
  end, function(seen)
    return #seen == 1 and seen[1].initialized
  end)
  return buffer
end

check('the server is attached', function()
  deployment = open_model('deployment.mal')
end)

check('what is not wanted is not written', function()
  answers = { 'Cancel' }
  put_cursor('activity pose')
  vim.lsp.buf.code_action()
  wait('a preview', function()
    return previews
  end, function(seen)
    return #seen == 1
  end)
  equal(true, has(previews[1], 'Orocos packages in ' .. in_robot('generated')), vim.inspect(previews[1]))
  equal(true, has(previews[1], 'create  motion/src/codels/clearance.cpp'), vim.inspect(previews[1]))
  vim.wait(300)
  equal(0, vim.fn.isdirectory(in_robot('generated')))
  -- The preview is gone, and the user is where he was.
  equal({ deployment, windows }, { vim.api.nvim_get_current_buf(), #vim.api.nvim_list_wins() })
end)

check('the code action on a deployment writes its packages', function()
  answers, told = { 'Generate' }, {}
  put_cursor('activity pose')
  vim.lsp.buf.code_action()
  wait_for_word('created in ' .. in_robot('generated'))
  equal(true, read('generated/motion/package.xml') ~= nil)
  equal(true, read('generated/motion/.mauve-manifest.json') ~= nil)
  -- No buffer is left to be written.
  local modified = vim.tbl_filter(function(buffer)
    return vim.bo[buffer].modified
  end, vim.api.nvim_list_bufs())
  equal({}, modified)
  local code, said = checked(checking.folder)
  equal(0, code, said)
end)

check('then nothing is left to do', function()
  told = {}
  vim.cmd('Mauve generate P3dxDeployment')
  wait_for_word('are up to date')
  vim.cmd('Mauve generate')
  vim.wait(500)
  equal(2, #previews, vim.inspect(told))
end)

check('packages that are no longer generated are listed', function()
  write('generated/old/.mauve-manifest.json', read('generated/motion/.mauve-manifest.json'))
  told = {}
  vim.cmd('Mauve generate')
  wait_for_word('generated/old: this package is no longer generated from these models; remove it if you do not need it.')
  equal(true, told[1]:find('are up to date', 1, true) ~= nil, told[1])
  vim.fn.delete(in_robot('generated/old'), 'rf')
end)

check('a prototype that changes is shown, and the file of the user stays', function()
  local file = 'generated/motion/src/codels/clearance.cpp'
  local mine = '// Mine.\n' .. read(file)
  write(file, mine)
  local model = open_model('components/switch.mal')
  local before = vim.api.nvim_buf_get_lines(model, 0, -1, false)
  replace('width: double): double', 'width: double): float')
  answers, previews, told = { 'Generate' }, {}, {}
  vim.cmd('Mauve generate exploration.P3dxDeployment')
  wait_for_word('changed in')
  local warning = 'motion/src/codels/clearance.cpp is now `float clearance(const ::sensor_msgs::LaserScan& scan'
  equal(true, has(previews[1], warning), vim.inspect(previews[1]))
  -- And what generated files become.
  equal(true, has(previews[1], '--- motion/include/motion/motion-codels.hpp'), vim.inspect(previews[1]))
  equal(mine, read(file))
  equal(true, read(file .. '.new') ~= nil)
  vim.api.nvim_buf_set_lines(model, 0, -1, false, before)
  answers, told = { 'Generate' }, {}
  vim.cmd('Mauve generate exploration.P3dxDeployment')
  wait_for_word('changed')
  equal(nil, read(file .. '.new'))
  local code, said = checked(checking.folder)
  equal(0, code, said)
  vim.cmd.buffer(deployment)
end)

check('what cannot be written leaves everything as it was', function()
  local path = 'generated/motion/package.xml'
  local header = 'generated/motion/include/motion/motion-codels.hpp'
  local before = read(header)
  vim.uv.fs_unlink(in_robot(path))
  vim.uv.fs_unlink(in_robot(header))
  -- It is not one of the server's.
  write('generated/.mauve-staging', 'Somebody else writes here.')
  answers, told = { 'Generate' }, {}
  vim.cmd('Mauve generate P3dxDeployment')
  wait_for_word('nothing was written')
  equal({ nil, nil }, { read(path), read(header) })
  equal('Somebody else writes here.', read('generated/.mauve-staging'))
  vim.uv.fs_unlink(in_robot('generated/.mauve-staging'))
  answers, told = { 'Generate' }, {}
  vim.cmd('Mauve generate P3dxDeployment')
  wait_for_word('2 created in')
  equal(before, read(header))
end)

check('what changes while the user is asked is shown again', function()
  local header = 'generated/motion/include/motion/motion-codels.hpp'
  local before = read(header)
  vim.uv.fs_unlink(in_robot(header))
  local select = vim.ui.select
  vim.ui.select = function(...)
    write(header, before)
    vim.ui.select = select
    select(...)
  end
  answers, told = { 'Generate' }, {}
  vim.cmd('Mauve generate P3dxDeployment')
  wait_for_word('are up to date')
  equal(true, told[1]:find('the files have changed in the meantime', 1, true) ~= nil, told[1])
end)

check('what was edited is not lost', function()
  local header = 'generated/motion/include/motion/motion-codels.hpp'
  local before = read(header)
  write(header, before .. '// Mine.\n')
  told = {}
  vim.cmd('Mauve generate')
  wait_for_word('`mauve generate --force`')
  equal(true, told[1]:find(header, 1, true) ~= nil, told[1])
  equal(before .. '// Mine.\n', read(header))
  write(header, before)
  -- Nor what is not saved.
  vim.uv.fs_unlink(in_robot('generated/motion/package.xml'))
  open('generated/motion/package.xml')
  vim.api.nvim_buf_set_lines(0, 0, -1, false, { '<mine/>' })
  vim.cmd.buffer({ deployment, bang = true })
  told = {}
  vim.cmd('Mauve generate')
  wait_for_word('has unsaved changes')
  vim.cmd('bwipeout! ' .. vim.fn.bufnr(in_robot('generated/motion/package.xml')))
  -- Whichever way leads there: Neovim follows the links of folders that are there, and of no others.
  local link, kept = unpack(vim.tbl_map(function(name)
    return vim.fs.joinpath(vim.fs.dirname(checking.folder), name)
  end, { 'link', 'kept' }))
  assert(vim.uv.fs_symlink(checking.folder, link))
  assert(vim.uv.fs_rename(in_robot('generated/motion'), kept))
  vim.cmd.edit(vim.fs.joinpath(link, 'generated/motion/package.xml'))
  local buffer = vim.api.nvim_get_current_buf()
  equal(vim.fs.joinpath(link, 'generated/motion/package.xml'), vim.api.nvim_buf_get_name(buffer))
  vim.api.nvim_buf_set_lines(buffer, 0, -1, false, { '<mine/>' })
  vim.cmd.buffer({ deployment, bang = true })
  told = {}
  vim.cmd('Mauve generate')
  wait_for_word('link/generated/motion/package.xml has unsaved changes')
  assert(vim.uv.fs_rename(kept, in_robot('generated/motion')))
  vim.cmd('bwipeout! ' .. buffer)
end)

check('a model with errors', function()
  replace('activity pose ', 'activity posse ')
  told = {}
  vim.cmd('Mauve generate P3dxDeployment')
  wait_for_word('error first: ')
  equal(true, told[1]:find('deployment.mal:', 1, true) ~= nil, told[1])
  vim.cmd('silent undo')
end)

-- A plain client applies the edit by itself, to buffers.

check('without the plugin', function()
  local folder = vim.fs.joinpath(vim.fs.dirname(checking.folder), 'plain')
  vim.system({ 'cp', '-R', checking.folder, folder }):wait()
  vim.system({ 'rm', '-rf', vim.fs.joinpath(folder, 'generated') }):wait()
  vim.cmd('noautocmd edit ' .. vim.fs.joinpath(folder, 'deployment.mal'))
  local buffer = vim.api.nvim_get_current_buf()
  local id = vim.lsp.start({ name = 'plain', cmd = { vim.env.MAUVE_TEST_SERVER, 'lsp' }, root_dir = folder })
  wait('a plain client', function()
    local client = vim.lsp.get_client_by_id(id)
    return client and client.initialized and vim.lsp.buf_is_attached(buffer, id)
  end, function(seen)
    return seen
  end)
  local function plain(title)
    return function(action, client)
      return (client == nil or client == id) and vim.startswith(action.title, title)
    end
  end
  put_cursor('activity pose')
  local manifest = vim.fs.joinpath(folder, 'generated/motion/.mauve-manifest.json')
  vim.lsp.buf.code_action({ apply = true, filter = plain('Generate Orocos packages of') })
  wait('a buffer for the manifest', function()
    return vim.fn.bufnr(manifest)
  end, function(seen)
    return seen ~= -1 and vim.bo[seen].modified
  end)
  vim.cmd('silent wall')
  local code, said = checked(folder)
  equal(0, code, said)
  -- Changes and removals as well.
  vim.cmd('silent edit ' .. vim.fs.joinpath(folder, 'components/switch.mal'))
  vim.lsp.buf_attach_client(0, id)
  replace('width: double): double', 'width: double): float')
  vim.cmd('silent write')
  vim.cmd.buffer(buffer)
  put_cursor('activity pose')
  local header = vim.fs.joinpath(folder, 'generated/motion/include/motion/motion-codels.hpp')
  vim.lsp.buf.code_action({ apply = true, filter = plain('Generate Orocos packages of') })
  wait('another header', function()
    return vim.fn.bufnr(header)
  end, function(seen)
    return seen ~= -1 and vim.bo[seen].modified
  end)
  vim.cmd('silent wall')
  code, said = checked(folder)
  -- The stub too, which nobody has edited.
  equal(0, code, said)
end)

checking.done()
