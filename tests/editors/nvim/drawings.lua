-- The drawings of the sample robot: opened, read, followed to their source, and changed by edits. Run by ./run.

local checking = dofile(vim.fs.joinpath(vim.fs.dirname(debug.getinfo(1, 'S').source:sub(2)), 'checking.lua'))
local check, equal, wait = checking.check, checking.equal, checking.wait
local put_cursor = checking.put_cursor

local file = vim.fs.joinpath(checking.folder, 'deployment.mal')

local function text_of(buffer)
  return table.concat(vim.api.nvim_buf_get_lines(buffer, 0, -1, false), '\n')
end

--- The buffer of a drawing in the current window, once it is there.
local function wait_for_drawing(kind)
  wait('a window with the ' .. kind, function()
    return vim.api.nvim_buf_get_name(0)
  end, function(name)
    return name:find('mauve://' .. kind, 1, true)
  end)
  return vim.api.nvim_get_current_buf()
end

local function wait_for_text(buffer, ...)
  local texts = { ... }
  wait('a drawing with ' .. vim.inspect(texts), function()
    return text_of(buffer)
  end, function(text)
    return vim.iter(texts):all(function(part)
      return text:find(part, 1, true)
    end)
  end)
end

local function press(keys)
  vim.api.nvim_feedkeys(vim.keycode(keys), 'xt', false)
end

vim.cmd.edit(file)
local source = vim.api.nvim_get_current_buf()
local source_window = vim.api.nvim_get_current_win()

local function replace(old, new)
  for number, line in ipairs(vim.api.nvim_buf_get_lines(source, 0, -1, false)) do
    local first, last = line:find(old, 1, true)
    if first then
      vim.api.nvim_buf_set_text(source, number - 1, first - 1, number - 1, last, { new })
      -- As when it is typed.
      vim.api.nvim_exec_autocmds('TextChanged', { buffer = source })
      return
    end
  end
  error('no line has ' .. old)
end

check('the server has analysed', function()
  wait('a server', function()
    return vim.lsp.get_clients({ bufnr = source, name = 'mauve' })
  end, function(clients)
    return clients[1] and clients[1].initialized
  end)
end)

local graph
check('the architecture, with response times', function()
  vim.cmd('Mauve graph')
  graph = wait_for_drawing('graph')
  wait_for_text(graph, 'P3dxDeployment at 1e-4', 'navigation: Navigation', '! 997 / 1000 ms · 29.4 %')
  equal(false, vim.wo.wrap)
  equal(false, vim.bo.modifiable)
end)

check('Enter goes to the activity, in the window of the text', function()
  put_cursor('teleop: Teleop')
  press('<CR>')
  equal(source_window, vim.api.nvim_get_current_win())
  wait('the activity', vim.api.nvim_get_current_line, function(line)
    return line:find('activity teleop', 1, true)
  end)
end)

check('the activity at the cursor is lit', function()
  local namespace = vim.api.nvim_get_namespaces()['mauve.drawings.lit']
  local function lit_words()
    return vim.tbl_map(function(extmark)
      local line = vim.api.nvim_buf_get_lines(graph, extmark[2], extmark[2] + 1, false)[1]
      return line:sub(extmark[3] + 1, extmark[4].end_col)
    end, vim.api.nvim_buf_get_extmarks(graph, namespace, 0, -1, { details = true }))
  end
  vim.api.nvim_set_current_win(source_window)
  for _, instance in ipairs({ 'hokuyo', 'teleop' }) do
    put_cursor('activity ' .. instance)
    vim.api.nvim_exec_autocmds('CursorMoved', { buffer = source })
    equal({ instance }, lit_words())
  end
end)

check('an edit changes the drawing, and nothing moves', function()
  local before = vim.api.nvim_buf_get_lines(graph, 0, -1, false)
  put_cursor('activity teleop')
  local line = vim.api.nvim_get_current_line()
  replace(line, (line:gsub('period = 100 ', 'period = 200 ')))
  wait('another utilisation', function()
    return text_of(graph)
  end, function(text)
    return text:find('70 / 100 ms · 3.5 %', 1, true)
  end)
  equal(#before, #vim.api.nvim_buf_get_lines(graph, 0, -1, false))
  vim.cmd('silent undo')
  vim.api.nvim_exec_autocmds('TextChanged', { buffer = source })
  wait_for_text(graph, '70 / 100 ms · 7.0 %')
  equal(before, vim.api.nvim_buf_get_lines(graph, 0, -1, false))
end)

--- The columns of the widest line.
local function widest(buffer)
  local widths = vim.tbl_map(vim.fn.strdisplaywidth, vim.api.nvim_buf_get_lines(buffer, 0, -1, false))
  return math.max(unpack(widths))
end

check('the drawing fits its window', function()
  for _, columns in ipairs({ 80, 100, 400, 60 }) do
    vim.o.columns = columns
    vim.api.nvim_exec_autocmds('WinResized', {})
    wait(('a drawing for %d columns'):format(columns), function()
      return { widest(graph), text_of(graph) }
    end, function(seen)
      -- With boxes where there is room for them.
      return seen[1] <= math.max(columns, 75) and (seen[2]:find('│ navigation: Navigation', 1, true) ~= nil) == (columns == 400)
    end)
  end
  vim.o.columns = 80
end)

check('a schedule of the instance at the cursor of a drawing, and of the deployment that it draws', function()
  vim.api.nvim_set_current_win(vim.fn.win_findbuf(graph)[1])
  put_cursor('hokuyo')
  vim.cmd('Mauve schedule')
  local schedule = wait_for_drawing('schedule')
  wait_for_text(schedule, 'of hokuyo: ✓ 53 / 100 ms')
  equal(true, widest(schedule) <= 80, text_of(schedule))
  put_cursor('executes')
  local notify, said = vim.notify, nil
  vim.notify = function(message)
    said = message
  end
  vim.cmd('Mauve machine')
  equal('mauve: put the cursor on a name of the drawing', said)
  vim.notify = notify
  vim.cmd('Mauve chains')
  local chains = wait_for_drawing('chains')
  wait_for_text(chains, 'P3dxDeployment at 1e-4')
  press('q')
  vim.api.nvim_set_current_win(vim.fn.win_findbuf(schedule)[1])
  press('q')
end)

check('q closes it', function()
  vim.api.nvim_set_current_win(vim.fn.win_findbuf(graph)[1])
  press('q')
  equal(false, vim.api.nvim_buf_is_valid(graph))
  vim.api.nvim_set_current_win(source_window)
end)

check('the state machine of the component at the cursor, in a float', function()
  put_cursor('activity navigation')
  put_cursor('navigation')
  vim.cmd('Mauve machine float')
  local machine = wait_for_drawing('machine')
  equal('editor', vim.api.nvim_win_get_config(0).relative)
  wait_for_text(machine, '> Waiting', 'already_there: 297*')
  put_cursor('Planning')
  press('<CR>')
  wait('the state', function()
    return { vim.fs.basename(vim.api.nvim_buf_get_name(0)), vim.api.nvim_get_current_line() }
  end, function(seen)
    return seen[1] == 'navigation.mal' and seen[2]:find('state Planning', 1, true)
  end)
  vim.cmd.buffer(source)
  vim.api.nvim_set_current_win(vim.fn.win_findbuf(machine)[1])
  vim.cmd.close()
end)

check('the schedule of the activity at the cursor', function()
  vim.api.nvim_set_current_win(source_window)
  put_cursor('activity teleop')
  vim.cmd('Mauve schedule')
  local schedule = wait_for_drawing('schedule')
  wait_for_text(schedule, 'job 1 of teleop: ✓ 70 / 100 ms, which is its bound', '█ executes')
  put_cursor('hokuyo')
  press('<CR>')
  wait('the activity', vim.api.nvim_get_current_line, function(line)
    return line:find('activity hokuyo', 1, true)
  end)
  -- It stays that of its activity while lines above come and go.
  vim.api.nvim_buf_set_lines(source, 0, 0, false, { '//', '//', '//' })
  replace('activity teleop      { affinity = 1  priority = 4   period = 100 ', 'activity teleop { affinity = 1  priority = 4   period = 150 ')
  wait_for_text(schedule, 'job 1 of teleop: ✓ 70 / 100 ms', '│140')
  vim.cmd('silent undo | silent undo')
  vim.api.nvim_set_current_win(vim.fn.win_findbuf(schedule)[1])
  press('q')
end)

check('the chains of the deployment', function()
  vim.api.nvim_set_current_win(source_window)
  vim.cmd.buffer(source)
  put_cursor('deployment P3dxDeployment')
  vim.cmd('Mauve chains')
  local chains = wait_for_drawing('chains')
  wait_for_text(chains, 'avoid: ✓ ≤ 526 / 600 ms', '? no bound', '░ waits for a release')
  -- It follows the text, and leads to the connection.
  replace('activity p3dx_driver { affinity = 1  priority = 10  period = 100 ', 'activity p3dx_driver { affinity = 1  priority = 10  period = 200 ')
  wait_for_text(chains, 'avoid: ✗ ≤ 626 / 600 ms')
  vim.api.nvim_buf_call(source, function()
    vim.cmd('silent undo')
  end)
  wait_for_text(chains, 'avoid: ✓ ≤ 526 / 600 ms')
  vim.api.nvim_set_current_win(vim.fn.win_findbuf(chains)[1])
  put_cursor('guidance')
  press('<CR>')
  wait('the connection', function()
    return vim.fs.basename(vim.api.nvim_buf_get_name(0)) .. ': ' .. vim.api.nvim_get_current_line()
  end, function(seen)
    return seen:find('exploration_architecture.mal: .*guidance%.scan')
  end)
  vim.cmd.buffer(source)
  vim.api.nvim_set_current_win(vim.fn.win_findbuf(chains)[1])
  press('q')
end)

check('the times of a codel', function()
  vim.api.nvim_set_current_win(source_window)
  vim.cmd.edit(vim.fs.joinpath(checking.folder, 'components/p3dx_driver.mal'))
  put_cursor('aria_drive')
  vim.cmd('Mauve times')
  local times = wait_for_drawing('times')
  wait_for_text(times, 'aria_drive: probability that an execution exceeds a time', '1e-4', '(current level)')
  press('q')
  vim.cmd.buffer(source)
end)

check('the tree of instances', function()
  vim.api.nvim_set_current_win(source_window)
  vim.cmd('Mauve tree')
  local tree = wait_for_drawing('tree')
  wait_for_text(tree, 'P3dxDeployment at 1e-4\n  CPU 1  ', '    hokuyo ', '✓ 53 / 100 ms', '  CPU 2  78.9 %', '    gmapping  ✓ 789 / 1000 ms')
  put_cursor('gmapping')
  press('<CR>')
  wait('the activity', vim.api.nvim_get_current_line, function(line)
    return line:find('activity gmapping', 1, true)
  end)
  replace('deadline = 1000', 'deadline = 990')
  wait('a missed deadline', function()
    return text_of(tree)
  end, function(text)
    return text:find('✗ ', 1, true) and text:find('/ 990 ms', 1, true)
  end)
  vim.cmd('silent undo')
  vim.api.nvim_set_current_win(vim.fn.win_findbuf(tree)[1])
  press('q')
end)

check('other values, and edits, beside the figures at the beginning', function()
  vim.api.nvim_set_current_win(source_window)
  put_cursor('activity hokuyo')
  vim.cmd('Mauve whatif hokuyo.deadline=50 teleop.period=200')
  local what_if = wait_for_drawing('whatif')
  wait_for_text(what_if, 'P3dxDeployment at 1e-4: 9 → 8 of 9 deadlines met', 'with hokuyo.deadline=50, teleop.period=200', '✓ 53 / 100 → ✗ 53 / 50 ms', 'no longer met')
  put_cursor('hokuyo ')
  press('<CR>')
  wait('the activity', vim.api.nvim_get_current_line, function(line)
    return line:find('activity hokuyo', 1, true)
  end)
  -- In the same window.
  vim.cmd('Mauve whatif')
  wait_for_text(what_if, '9 of 9 deadlines met, as before')
  vim.cmd('Mauve whatif hokuyo.perod=5')
  local namespace = vim.api.nvim_get_namespaces()['mauve.drawings']
  wait('what is wrong, beside the last figures', function()
    local marks = vim.api.nvim_buf_get_extmarks(what_if, namespace, 0, -1, { details = true })
    return marks[1] and marks[1][4].virt_text[1][1] or ''
  end, function(text)
    return text:find('did you mean `hokuyo.period`', 1, true)
  end)
  vim.cmd('Mauve whatif')
  replace('priority = 9   period = 100   deadline = 100', 'priority = 9   period = 100   deadline = 50')
  wait_for_text(what_if, '9 → 8 of 9 deadlines met', '✓ 53 / 100 → ✗ 53 / 50 ms')
  vim.api.nvim_buf_call(source, function()
    vim.cmd('silent undo')
  end)
  vim.api.nvim_exec_autocmds('TextChanged', { buffer = source })
  wait_for_text(what_if, '9 of 9 deadlines met, as before')
  vim.api.nvim_set_current_win(vim.fn.win_findbuf(what_if)[1])
  press('q')
end)

check('how probable it is that the activity at the cursor is late', function()
  vim.api.nvim_set_current_win(source_window)
  put_cursor('activity hokuyo')
  vim.cmd('Mauve probability')
  local probability = wait_for_drawing('probability')
  wait_for_text(probability, 'hokuyo of P3dxDeployment: late at most 1.5e-4 times an hour', '1e-6  ≤ 58 ms', 'if the hour begins without unfinished jobs')
  replace('activity hokuyo      { affinity = 1  priority = 9   period = 100 ', 'activity hokuyo      { affinity = 1  priority = 9   period = 200 ')
  wait('another probability', function()
    return text_of(probability)
  end, function(text)
    return text:find('late at most ', 1, true) and not text:find('late at most 1.5e-4', 1, true)
  end)
  vim.api.nvim_buf_call(source, function()
    vim.cmd('silent undo')
  end)
  vim.api.nvim_exec_autocmds('TextChanged', { buffer = source })
  wait_for_text(probability, 'late at most 1.5e-4 times an hour')
  vim.api.nvim_set_current_win(vim.fn.win_findbuf(probability)[1])
  press('q')
end)

check('problems, the worst first, with fixes', function()
  local mauve = require('mauve')
  vim.api.nvim_set_current_win(source_window)
  equal(vim.fn.readfile(file), vim.api.nvim_buf_get_lines(source, 0, -1, false))
  vim.o.statusline = "%{%v:lua.require'mauve'.statusline()%}"
  local function wait_for_verdict(text, group)
    wait('the verdict ' .. text, function()
      return vim.api.nvim_eval_statusline(vim.o.statusline, { highlights = true })
    end, function(seen)
      local highlight = seen.highlights[#seen.highlights > 1 and #seen.highlights - 1 or 1]
      return seen.str:find('MAUVE ' .. text, 1, true) and highlight.group == group
    end)
  end
  wait_for_verdict('! 9 met', 'MauveTight')
  replace('period = 1000  deadline = 1000 }', 'period = 1000  deadline = 990 }')
  replace('activity hokuyo      { affinity = 1  priority = 9   period = 100   deadline = 100', 'activity hokuyo      { affinity = 1  priority = 9   period = 100   deadline = 30')
  wait_for_verdict('✗ 2 late', 'MauveMissed')
  mauve.clicked(0, 1, 'l', '    ')
  local problems = wait_for_drawing('problems')
  wait_for_text(problems, '✗ navigation 997 / 990 ms  ', '    → ')
  local text = text_of(problems)
  -- hokuyo has the least slack relative to its deadline.
  local order = { 'MAUVE ✗ 2 late', '✗ hokuyo 53 / 30 ms', '`hokuyo` misses', '✗ navigation 997 / 990 ms' }
  local at = 0
  for _, part in ipairs(order) do
    local found = text:find(part, at + 1, true)
    equal(true, found ~= nil, part .. '\n' .. text)
    at = found
  end
  put_cursor('✗ navigation')
  press('<CR>')
  wait('the activity', vim.api.nvim_get_current_line, function(line)
    return line:find('activity navigation', 1, true)
  end)
  vim.api.nvim_set_current_win(vim.fn.win_findbuf(problems)[1])
  wait_for_text(problems, 'Relax the deadline of navigation')
  put_cursor('→ Relax the deadline of navigation')
  press('<CR>')
  wait_for_verdict('✗ 1 late', 'MauveMissed')
  wait('a shorter list', function()
    return text_of(problems)
  end, function(seen)
    return not seen:find('✗ navigation', 1, true) and seen:find('✗ hokuyo', 1, true)
  end)
  vim.api.nvim_buf_call(source, function()
    vim.cmd('silent earlier 1f')
  end)
  wait_for_verdict('! 9 met', 'MauveTight')
  vim.api.nvim_set_current_win(vim.fn.win_findbuf(problems)[1])
  press('q')
  vim.api.nvim_set_current_win(source_window)
end)

check('a recording is compared with the model in a terminal', function()
  local recording = vim.fs.joinpath(vim.fs.dirname(checking.folder), 'recording.csv')
  vim.fn.writefile({ 'codel,execution_ns,instance', 'navigation.astar,400000000,navigation' }, recording)
  vim.cmd('Mauve trace check ' .. recording)
  equal('terminal', vim.bo.buftype)
  local terminal = vim.api.nvim_get_current_buf()
  wait_for_text(terminal, 'P3dxDeployment: a recording beside the model')
  wait('the end', function()
    return vim.fn.execute('messages')
  end, function(text)
    return text:find('mauve trace ended with findings (exit code 1)', 1, true)
  end)
  press('q')
  equal(false, vim.api.nvim_buf_is_valid(terminal))
  equal({ 'check', 'export', 'import' }, vim.fn.getcompletion('Mauve trace ', 'cmdline'))
end)

check('the drawing in the browser', function()
  local opened
  vim.ui.open = function(path)
    opened = path
  end
  vim.api.nvim_set_current_win(source_window)
  vim.cmd('Mauve graph browser')
  wait('a file', function()
    return opened
  end, function(path)
    return path ~= nil
  end)
  local svg = table.concat(vim.fn.readfile(opened), '\n')
  equal('<svg ', svg:sub(1, 5))
  equal(true, svg:find('! 997 / 1000 ms', 1, true) ~= nil)
end)

check('a drawing of what is not there is refused', function()
  local said
  local notify = vim.notify
  vim.notify = function(message)
    said = message
  end
  vim.api.nvim_win_set_cursor(source_window, { 1, 0 })
  vim.cmd('Mauve machine')
  wait('a message', function()
    return said
  end, function(message)
    return message and message:find('no component, instance or activity here', 1, true)
  end)
  vim.cmd('Mauve graph moon')
  equal('mauve: no place "moon"; there are: split, float, browser', said)
  vim.notify = notify
end)

checking.done()
