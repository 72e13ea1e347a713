-- What a user sees of the server in Neovim, on a copy of the sample robot. Run by ./run.

local checking = dofile(vim.fs.joinpath(vim.fs.dirname(debug.getinfo(1, 'S').source:sub(2)), 'checking.lua'))
local check, equal, wait = checking.check, checking.equal, checking.wait

local function in_robot(path)
  return vim.fs.joinpath(checking.folder, path)
end

local function open(path)
  vim.cmd.edit(in_robot(path))
  return vim.api.nvim_get_current_buf()
end

-- Looking

--- The first line of a buffer with this text, counted from 1.
local function line_of(buffer, text)
  for number, line in ipairs(vim.api.nvim_buf_get_lines(buffer, 0, -1, false)) do
    if line:find(text, 1, true) then
      return number, line
    end
  end
  error(('no line of %s has "%s"'):format(vim.api.nvim_buf_get_name(buffer), text))
end

local function put_cursor(text, word)
  local number, line = line_of(0, text)
  vim.api.nvim_win_set_cursor(0, { number, line:find(word or text, line:find(text, 1, true), true) - 1 })
end

--- What is drawn at the end of a line, with its highlight groups.
local function drawn(buffer, text)
  local number = line_of(buffer, text)
  local result = {}
  local namespace = vim.api.nvim_get_namespaces()['mauve.figures']
  local first, last = { number - 1, 0 }, { number - 1, -1 }
  for _, mark in ipairs(vim.api.nvim_buf_get_extmarks(buffer, namespace, first, last, { details = true })) do
    -- Nothing but text that is typed at the end of the line moves a figure.
    local pos = mark[4].virt_text_pos
    equal(true, pos == 'eol' or pos == 'overlay' or mark[3] == #vim.api.nvim_buf_get_lines(buffer, number - 1, number, false)[1])
    for _, chunk in ipairs(mark[4].virt_text or {}) do
      table.insert(result, { text = vim.trim(chunk[1]), group = chunk[2] })
    end
  end
  return result
end

local deployment
--- Waits for a hint beside an activity with all of these texts, and returns it. It must be drawn in a window.
local function wait_for_hint(activity, ...)
  local texts = { ... }
  local found
  wait('a hint with ' .. vim.inspect(texts) .. ' beside ' .. activity, function()
    return drawn(deployment, 'activity ' .. activity)
  end, function(hints)
    for _, hint in ipairs(hints) do
      local all = vim.iter(texts):all(function(text)
        return hint.text:find(text, 1, true)
      end)
      if all then
        found = hint
        return true
      end
    end
  end)
  return found
end

local function missed(buffer)
  local result = vim.tbl_filter(function(diagnostic)
    return diagnostic.code == 'deadline-missed'
  end, vim.diagnostic.get(buffer))
  return vim.tbl_map(function(diagnostic)
    local text = vim.api.nvim_buf_get_text(
      buffer,
      diagnostic.lnum,
      diagnostic.col,
      diagnostic.end_lnum,
      diagnostic.end_col,
      {}
    )
    return { diagnostic.source, text[1] }
  end, result)
end

--- Waits until exactly these activities of the deployment have missed deadlines.
local function wait_for_missed(...)
  local expected = vim.tbl_map(function(activity)
    return { 'mauve', activity }
  end, { ... })
  wait('diagnostics deadline-missed: ' .. vim.inspect(expected), function()
    return missed(deployment)
  end, function(seen)
    return vim.deep_equal(expected, seen)
  end)
end

local function wait_for_place(file, text)
  wait(('the cursor in %s at %s'):format(file, text), function()
    return { vim.api.nvim_buf_get_name(0), vim.api.nvim_get_current_line():sub(vim.fn.col('.')) }
  end, function(seen)
    return seen[1] == in_robot(file) and vim.startswith(seen[2], text)
  end)
end

-- Doing

--- Replaces a text in the first line that has it, as one change to be undone.
local function replace(buffer, line_text, old, new)
  local number, line = line_of(buffer, line_text)
  local first, last = line:find(old, 1, true)
  vim.bo[buffer].undolevels = vim.bo[buffer].undolevels
  vim.api.nvim_buf_set_text(buffer, number - 1, first - 1, number - 1, last, { new })
end

local function undo(buffer)
  vim.api.nvim_buf_call(buffer, function()
    vim.cmd('silent undo')
  end)
end

--- Writes a file as another program does.
local function change_file(path, old, new)
  local file = assert(io.open(in_robot(path)))
  local text = file:read('*a')
  file:close()
  local first, last = text:find(old, 1, true)
  file = assert(io.open(in_robot(path), 'w'))
  file:write(text:sub(1, first - 1), new, text:sub(last + 1))
  file:close()
end

-- The checks. Each leaves the robot as it was.

local navigation = 'activity navigation'
local table_file = 'timing/p3dx.toml'
local astar = '"navigation.astar"'

check('the server is attached', function()
  deployment = open('deployment.mal')
  local clients = wait('a client', function()
    return vim.lsp.get_clients({ bufnr = deployment, name = 'mauve' })
  end, function(seen)
    return #seen == 1 and seen[1].initialized
  end)
  equal(checking.folder, clients[1].config.root_dir)
end)

check('a response time is drawn beside its activity', function()
  put_cursor(navigation)
  wait_for_hint('navigation', '! 997 / 1000')
  equal({}, missed(deployment))
end)

check('a deadline that is edited is missed, until that is undone', function()
  replace(deployment, navigation, 'deadline = 1000', 'deadline = 990')
  wait_for_missed('navigation')
  wait_for_hint('navigation', '✗ 997 / 990')
  undo(deployment)
  wait_for_missed()
  wait_for_hint('navigation', '! 997 / 1000')
end)

check('the period of one activity changes the response time of another', function()
  replace(deployment, 'activity teleop', 'period = 100   deadline = 100', 'period = 90  deadline = 90')
  wait_for_missed('navigation')
  wait_for_hint('navigation', '✗ CPU 1 overloaded')
  wait_for_hint('teleop', '✓ 70 / 90')
  undo(deployment)
  wait_for_missed()
  wait_for_hint('navigation', '! 997 / 1000')
end)

check('characters of several bytes move nothing', function()
  replace(deployment, navigation, 'activity', '/* µs 𝛑 é */ activity')
  replace(deployment, navigation, 'deadline = 1000', 'deadline = 990')
  wait_for_missed('navigation')
  wait_for_hint('navigation', '✗ 997 / 990')
  undo(deployment)
  wait_for_missed()
  put_cursor(navigation, 'navigation')
  vim.lsp.buf.definition()
  wait_for_place('navigation_architecture.mal', 'navigation: Navigation')
  vim.cmd.buffer(deployment)
  undo(deployment)
  wait_for_hint('navigation', '! 997 / 1000')
end)

check('each status has its highlight group', function()
  equal('MauveTight', wait_for_hint('navigation', '! 997 / 1000').group)
  equal('MauveMet', wait_for_hint('hokuyo', '✓ 53 / 100').group)
  equal('DiagnosticOk', vim.api.nvim_get_hl(0, { name = 'MauveMet' }).link)
  replace(deployment, navigation, 'deadline = 1000', 'deadline = 990')
  equal('MauveMissed', wait_for_hint('navigation', '✗ 997 / 990').group)
  undo(deployment)
  -- Values of the architecture as well, and nothing twice.
  wait_for_hint('navigation', '! 997 / 1000')
  for _, client in ipairs(vim.lsp.get_clients({ name = 'mauve' })) do
    equal(nil, client.server_capabilities.inlayHintProvider)
  end
end)

check('older figures stand while a text is incomplete', function()
  replace(deployment, navigation, 'period = 1000', 'period = ')
  equal('MauveOlder', wait_for_hint('navigation', '… 997 / 1000').group)
  equal('MauveMet', wait_for_hint('gmapping', '✓ 789 / 1000').group)
  -- Key by key, there is a figure beside every activity.
  local number, line = line_of(deployment, navigation)
  local column = select(2, line:find('period = ', 1, true))
  for index = 1, 4 do
    vim.api.nvim_buf_set_text(deployment, number - 1, column, number - 1, column, { ('0001'):sub(index, index) })
    for _ = 1, 12 do
      vim.wait(10)
      for _, activity in ipairs({ 'hokuyo', 'navigation', 'gmapping' }) do
        equal(1, #drawn(deployment, 'activity ' .. activity), activity)
      end
    end
  end
  wait_for_hint('navigation', '! 997 / 1000')
  for _ = 1, 5 do
    undo(deployment)
  end
  wait_for_hint('navigation', '! 997 / 1000')
  equal('MauveTight', wait_for_hint('navigation', '! 997 / 1000').group)
end)

--- The text of a window as it is on the screen.
local function screen(window)
  local place = vim.fn.getwininfo(window)[1]
  local text = ''
  for row = place.winrow, place.winrow + place.height - 1 do
    for column = place.wincol, place.wincol + place.width - 1 do
      text = text .. vim.fn.screenstring(row, column)
    end
    text = text .. '\n'
  end
  return text
end

check('figures are whole in windows of any width', function()
  local window = vim.api.nvim_get_current_win()
  local shown, shortest = {}, 0
  for _, width in ipairs({ 78, 60, 48, 47, 38, 31, 25 }) do
    vim.cmd('vertical botright new | wincmd p | vertical resize ' .. width)
    equal(width, vim.api.nvim_win_get_width(window))
    -- Neovim sends it when it waits for a key.
    vim.api.nvim_exec_autocmds('WinResized', {})
    for _, activity in ipairs({ 'p3dx_driver', 'hokuyo', 'control', 'navigation', 'gmapping' }) do
      vim.fn.cursor(line_of(deployment, 'activity ' .. activity), 1)
      vim.cmd('normal! zt')
      local text = wait(('the hint of %s in %d columns'):format(activity, width), function()
        return { drawn(deployment, 'activity ' .. activity)[1].text, screen(window) }
      end, function(seen)
        return seen[2]:find('%s' .. vim.pesc(seen[1]))
      end)[1]
      shown[text] = true
      shortest = shortest + (text == '✓' and 1 or 0)
    end
    vim.cmd('only')
  end
  -- Response times where there is room for them, and less in narrow windows.
  equal({ true, true }, { shown['✓ 53 / 100 ms'], shortest > 0 }, vim.inspect(shown))
  vim.cmd('normal! gg')
  wait_for_hint('hokuyo', '✓ 53 / 100')
end)

check('in lines that go on beyond the window, the mark is in the indentation', function()
  vim.wo.wrap = false
  vim.cmd('vertical botright new | wincmd p | vertical resize 60')
  vim.api.nvim_exec_autocmds('WinResized', {})
  local window = vim.api.nvim_get_current_win()
  for activity, mark in pairs({ navigation = '!', hokuyo = '✓' }) do
    wait('the mark of ' .. activity, function()
      return screen(window)
    end, function(text)
      return text:find(mark .. '   activity ' .. activity, 1, true)
    end)
  end
  vim.cmd('only | set wrap')
  wait_for_hint('hokuyo', '✓ 53 / 100')
end)

check('figures are marked when the server does not answer', function()
  local function signal(name)
    vim.system({ 'pkill', '-' .. name, '-f', vim.lsp.get_clients({ name = 'mauve' })[1].config.cmd[1] .. ' lsp' }):wait()
  end
  signal('STOP')
  replace(deployment, navigation, 'deadline = 1000', 'deadline = 990')
  vim.api.nvim_buf_set_lines(deployment, 0, 0, false, { '// A line', '// and another' })
  local late = wait_for_hint('hokuyo', '… 53 / 100')
  -- Each is with its activity, though the server knows nothing of the new lines.
  equal(true, drawn(deployment, 'activity switch')[1].text:find('56 / 100', 1, true) ~= nil)
  signal('CONT')
  equal('MauveOlder', late.group)
  local function wait_for_group(activity, text, group)
    wait(('%s beside %s in %s'):format(text, activity, group), function()
      return drawn(deployment, 'activity ' .. activity)[1]
    end, function(hint)
      return hint.group == group and vim.startswith(hint.text, text)
    end)
  end
  wait_for_group('navigation', '✗ 997 / 990', 'MauveMissed')
  wait_for_group('hokuyo', '✓ 53 / 100', 'MauveMet')
  vim.api.nvim_buf_set_lines(deployment, 0, 2, false, {})
  replace(deployment, navigation, 'deadline = 990', 'deadline = 1000')
  wait_for_group('navigation', '! 997 / 1000', 'MauveTight')
end)

check('the focus has the server look at its files', function()
  local rpc, told = vim.lsp.get_clients({ name = 'mauve' })[1].rpc, {}
  local notify = rpc.notify
  rpc.notify = function(method, ...)
    table.insert(told, method)
    return notify(method, ...)
  end
  vim.api.nvim_exec_autocmds('FocusGained', {})
  rpc.notify = notify
  equal({ 'mauve/focus' }, told)
end)

check('a table that is edited, saved, and abandoned', function()
  vim.cmd('belowright split')
  local times = open(table_file)
  wait('a client for the table', function()
    return #vim.lsp.get_clients({ bufnr = times, name = 'mauve' })
  end, function(count)
    return count == 1
  end)

  replace(times, astar, '293', '273')
  wait_for_hint('navigation', '! 977 / 1000')
  vim.cmd('silent write')
  wait_for_hint('navigation', '! 977 / 1000')
  replace(times, astar, '273', '303')
  wait_for_missed('navigation')
  wait_for_hint('navigation', '✗ CPU 1 overloaded')

  -- What was saved counts again.
  vim.cmd('bwipeout!')
  wait_for_missed()
  wait_for_hint('navigation', '! 977 / 1000')
end)

check('a table that another program writes', function()
  equal(-1, vim.fn.bufnr(in_robot(table_file)))
  change_file(table_file, '273', '303')
  wait_for_missed('navigation')
  wait_for_hint('navigation', '✗ CPU 1 overloaded')
  change_file(table_file, '303', '293')
  wait_for_missed()
  wait_for_hint('navigation', '! 997 / 1000')
end)

check('a buffer that was hidden meanwhile', function()
  local times = open(table_file)
  replace(times, astar, '293', '273')
  vim.wait(500)
  vim.cmd.buffer(deployment)
  wait_for_hint('navigation', '! 977 / 1000')
  undo(times)
  wait_for_hint('navigation', '! 997 / 1000')
  vim.cmd('bwipeout! ' .. times)
end)

check('the level in mauve.toml', function()
  local project = open('mauve.toml')
  vim.cmd.buffer(deployment)
  replace(project, 'significance', '1e-4', '1e-3')
  wait_for_hint('navigation', '✓ 882 / 1000')
  vim.cmd('bwipeout! ' .. project)
  wait_for_hint('navigation', '! 997 / 1000')
end)

check('a level that is chosen', function()
  vim.cmd('Mauve significance 1e-3')
  wait_for_hint('navigation', '✓ 882 / 1000')
  vim.cmd('Mauve significance mauve.toml')
  wait_for_hint('navigation', '! 997 / 1000')
end)

check('another model file', function()
  local core = open('components/navigation.mal')
  vim.cmd.buffer(deployment)
  replace(core, 'attempts = attempts + 1;', 'attempts', 'simplify(route, tolerance); attempts')
  wait_for_hint('navigation', '! 998.3 / 1000')
  undo(core)
  wait_for_hint('navigation', '! 997 / 1000')
end)

check('names have the colours of what they mean', function()
  local function colour(text, word)
    local number, line = line_of(0, text)
    local column = line:find(word, line:find(text, 1, true), true) - 1
    return function()
      local tokens = vim.lsp.semantic_tokens.get_at_pos(0, number - 1, column) or {}
      return vim.tbl_map(function(token)
        return token.type .. ' ' .. table.concat(vim.tbl_keys(token.modifiers), ' ')
      end, tokens)
    end
  end
  local function wait_for_colour(text, word, expected)
    wait(('%s in "%s" to be %s'):format(word, text, expected), colour(text, word), function(seen)
      return vim.deep_equal({ expected }, seen)
    end)
  end
  wait_for_colour(navigation, 'navigation', 'instance ')
  open('components/navigation.mal')
  wait_for_colour('write(next, target)', 'next', 'port ' .. (colour('write(next, target)', 'next')()[1] or ''):sub(6))
  wait_for_colour('to Planning', 'Planning', 'state ')
  equal('@lsp.type.enumMember', vim.api.nvim_get_hl(0, { name = '@lsp.type.state.mauve' }).link)
  -- What another file takes away means nothing any more.
  local here = vim.api.nvim_get_current_buf()
  local shell = open('components/navigation_shell.mal')
  vim.cmd.buffer(here)
  replace(shell, 'output port next', 'next', 'other')
  wait('no colour', colour('write(next, target)', 'next'), vim.tbl_isempty)
  undo(shell)
  wait('a colour', colour('write(next, target)', 'next'), function(seen)
    return #seen == 1
  end)
  vim.cmd.buffer(deployment)
end)

check('a text is formatted, and only it', function()
  local model = open('components/navigation.mal')
  local before = vim.api.nvim_buf_get_lines(model, 0, -1, false)
  replace(model, 'wanted = true;', 'wanted = true;', 'wanted=true ;')
  vim.lsp.buf.format({ async = false })
  local _, line = line_of(model, 'wanted = true')
  equal('            wanted = true;', line)
  undo(model)
  undo(model)
  equal(before, vim.api.nvim_buf_get_lines(model, 0, -1, false))
  vim.cmd.buffer(deployment)
end)

check('definitions, from file to file', function()
  put_cursor(navigation, 'navigation')
  vim.lsp.buf.definition()
  wait_for_place('navigation_architecture.mal', 'navigation: Navigation')
  put_cursor('instance navigation: Navigation', 'Navigation')
  vim.lsp.buf.definition()
  wait_for_place('components/navigation.mal', 'Navigation(NavigationShell, NavigationCore)')
  -- As CTRL-] does it.
  put_cursor('component Navigation', 'NavigationShell')
  vim.cmd('normal! ' .. vim.keycode('<C-]>'))
  wait_for_place('components/navigation_shell.mal', 'NavigationShell {')
  vim.cmd.buffer(deployment)
end)

check('hover has the response time', function()
  put_cursor(navigation, 'navigation')
  vim.lsp.buf.hover()
  wait('a floating window with 997 ms', function()
    for _, window in ipairs(vim.api.nvim_list_wins()) do
      if vim.api.nvim_win_get_config(window).relative ~= '' then
        return table.concat(vim.api.nvim_buf_get_lines(vim.api.nvim_win_get_buf(window), 0, -1, false), '\n')
      end
    end
  end, function(text)
    return text and text:find('997 ms', 1, true)
  end)
  vim.cmd('fclose!')
end)

check('document symbols', function()
  local parameters = { textDocument = vim.lsp.util.make_text_document_params(deployment) }
  local replies = vim.lsp.buf_request_sync(deployment, 'textDocument/documentSymbol', parameters, 60000) or {}
  local names = {}
  local function collect(symbols)
    for _, symbol in ipairs(symbols) do
      names[symbol.name] = true
      collect(symbol.children or {})
    end
  end
  for _, reply in pairs(replies) do
    collect(reply.result or {})
  end
  equal({ true, true }, { names.P3dxDeployment, names.navigation }, vim.inspect(replies))
end)

--- Types keys as a user does, and looks at the menu of completions before it is left.
local function completions(keys)
  local words = {}
  local timer = assert(vim.uv.new_timer())
  local asked = 0
  timer:start(100, 100, vim.schedule_wrap(function()
    if timer:is_closing() then
      return
    end
    asked = asked + 1
    local items = vim.fn.complete_info({ 'items' }).items or {}
    if #items > 0 or asked > 600 then
      timer:close()
      for _, item in ipairs(items) do
        table.insert(words, item.word)
      end
      vim.api.nvim_feedkeys(vim.keycode('<C-e><Esc>'), 'nt', false)
    end
  end))
  -- The mode lasts until Escape is typed.
  vim.api.nvim_feedkeys(vim.keycode(keys .. '<C-x><C-o>'), 'ntx!', false)
  return words
end

check('only what fits is completed', function()
  -- Nothing but the instance that has no activity any more.
  put_cursor('activity teleop', 'teleop')
  local words = completions('C')
  local function has(name)
    -- Neovim 0.10 has the whole skeleton for a word.
    return vim.iter(words):any(function(word)
      return vim.startswith(word, name)
    end)
  end
  equal({ true, false }, { has('teleop'), has('navigation') }, vim.inspect(words))
  undo(deployment)
  wait_for_hint('navigation', '! 997 / 1000')
end)

check('references, in all files', function()
  local function found()
    return vim.tbl_map(function(item)
      return vim.fs.basename(vim.api.nvim_buf_get_name(item.bufnr))
    end, vim.fn.getqflist())
  end
  put_cursor(navigation, 'navigation')
  vim.fn.setqflist({})
  vim.lsp.buf.references()
  wait('places in two files', found, function(files)
    return vim.tbl_contains(files, 'deployment.mal') and vim.tbl_contains(files, 'navigation_architecture.mal')
  end)
  vim.cmd('cclose')
end)

check('a name is changed wherever it is used, and nowhere else', function()
  local buffers = { deployment, open('navigation_architecture.mal'), open('exploration_architecture.mal') }
  vim.cmd.buffer(deployment)
  local function lines()
    return vim.tbl_map(function(buffer)
      return table.concat(vim.api.nvim_buf_get_lines(buffer, 0, -1, false), '\n')
    end, buffers)
  end
  local before = lines()
  put_cursor(navigation, 'navigation')
  vim.lsp.buf.rename('planner')
  wait('another name', lines, function(seen)
    return seen[1]:find('activity planner ', 1, true)
      and seen[2]:find('connection planner.next -> control.target', 1, true)
      and seen[3]:find('-> planner.goal', 1, true)
  end)
  -- The library has the same name, and keeps it.
  equal(true, lines()[2]:find('library navigation {', 1, true) ~= nil)
  wait_for_hint('planner', '! 997 / 1000')
  vim.tbl_map(undo, buffers)
  equal(before, lines())
  wait_for_hint('navigation', '! 997 / 1000')
end)

check('a quick fix', function()
  local model = open('components/navigation.mal')
  local before = vim.api.nvim_buf_get_lines(model, 0, -1, false)
  replace(model, 'astar(', 'astar(', 'astra(')
  put_cursor('astra(')
  wait('a diagnostic', function()
    return vim.diagnostic.get(model)
  end, function(seen)
    return vim.iter(seen):any(function(diagnostic)
      return diagnostic.message:find('astra', 1, true) ~= nil
    end)
  end)
  vim.lsp.buf.code_action({
    apply = true,
    filter = function(action)
      return vim.startswith(action.kind or '', 'quickfix') and action.title:find('astar', 1, true) ~= nil
    end,
  })
  wait('what was meant', function()
    return vim.api.nvim_buf_get_lines(model, 0, -1, false)
  end, function(lines)
    return vim.deep_equal(before, lines)
  end)
  vim.cmd.buffer(deployment)
  wait_for_hint('navigation', '! 997 / 1000')
end)

check('the YAML of an executor has the figures of its threads, and no other YAML', function()
  local outside = vim.fs.joinpath(vim.fs.dirname(checking.folder), 'threads.yaml')
  vim.fn.system({ vim.fs.joinpath(vim.fs.dirname(vim.env.MAUVE_TEST_SCRIPT), '../threads'), checking.folder })
  vim.fn.writefile(vim.fn.readfile(in_robot('threads.yaml')), outside)
  vim.cmd('edit!')
  local group = 'id: /gmapping'
  local threads = open('threads.yaml')
  wait('a hint beside the callback group', function()
    return drawn(threads, group)
  end, function(hints)
    return hints[1] and hints[1].text:find('✓ 789 / 1000', 1, true) and hints[1].group == 'MauveMet'
  end)
  equal({ 'yaml', '' }, { vim.bo.filetype, vim.bo.formatexpr })
  local other = open('other.yaml')
  wait('a client', function()
    return vim.lsp.get_clients({ bufnr = other, name = 'mauve' })
  end, function(clients)
    return #clients == 1
  end)
  -- The answer about the other file is later than its own.
  replace(threads, 'priority: 3', '3', '2')
  replace(threads, 'affinity', '[1]', '[0]')
  wait_for_hint('gmapping', '✗')
  equal({ {}, {} }, { drawn(other, group), vim.diagnostic.get(other) })
  vim.cmd.edit(outside)
  equal({ 'yaml', {} }, { vim.bo.filetype, vim.lsp.get_clients({ bufnr = 0 }) })
  vim.cmd.buffer(deployment)
  vim.cmd('bwipeout! ' .. threads)
  wait_for_hint('gmapping', '✓ 789 / 1000')
end)

check('the server can be restarted', function()
  -- Neovim asks again when it is told to, even if it has just said that it leaves; then it is refused, and shows that.
  vim.wait(500)
  local old = vim.lsp.get_clients({ name = 'mauve' })[1].id
  vim.cmd('Mauve restart')
  wait('another client', function()
    return vim.lsp.get_clients({ bufnr = deployment, name = 'mauve' })
  end, function(clients)
    return #clients == 1 and clients[1].id ~= old and clients[1].initialized
  end)
  replace(deployment, navigation, 'deadline = 1000', 'deadline = 995')
  wait_for_hint('navigation', '✗ ')
  wait_for_missed('navigation')
end)

checking.done()
