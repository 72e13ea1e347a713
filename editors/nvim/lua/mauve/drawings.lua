-- Drawings in windows: the architecture, a state machine, a schedule and the times of a codel, in characters as the server draws
-- them, and the instances as a tree. They follow the text while it is edited.

local mauve = require('mauve')

local M = {}

--- What can be shown. Each asks the server for a method, and makes lines and places of the answer.
---@class mauve.Drawing
---@field method string
---@field at_cursor boolean  whether it shows what is at the cursor
---@field is_tree? boolean
---@field pin? fun(params: table, answer: any)  asks for the same thing by its name, since edits move positions
---@field lines fun(answer: any): string[]
---@field places fun(answer: any): table<string, lsp.Location>  by the words that stand for them

local function lines_of(text)
  return vim.split((text:gsub('\n+$', '')), '\n', { plain = true })
end

--- Adds a place for a word, if it has none. Null is `vim.NIL`.
local function add(places, word, place)
  if type(place) == 'table' and word ~= vim.NIL and not places[word] then
    places[word] = place
  end
end

local function reasons(answer)
  local found = {}
  for _, reason in ipairs(answer.reasons or {}) do
    table.insert(found, 'no times: ' .. reason)
  end
  return found
end

--- A drawing, or why there is none.
local function drawing_of(answer)
  local lines = type(answer.drawing) == 'string' and lines_of(answer.drawing) or {}
  return vim.list_extend(lines, reasons(answer))
end

local function graph_places(graphs)
  local places = {}
  for _, graph in ipairs(graphs) do
    for _, node in ipairs(graph.nodes) do
      add(places, node.instance, type(node.activity) == 'table' and node.activity or node.location)
      add(places, node.component, node.location)
    end
  end
  return places
end

local MARKS = { met = '✓', missed = '✗', unbounded = '✗', ['no-bound'] = '✗', background = '·', ['not-analysed'] = '?' }

local function number(value)
  return ('%.10g'):format(value)
end

--- `53 ≤ 100 ms`, or why there is no figure.
local function figure(node)
  if type(node.response) == 'number' and type(node.deadline) == 'number' then
    local sign = node.response <= node.deadline and '≤' or '>'
    return ('%s %s %s ms'):format(number(node.response), sign, number(node.deadline))
  end
  return node.status ~= vim.NIL and (node.status:gsub('-', ' ')) or ''
end

--- A significance level as the server writes it: `1e-4`.
local function level(value)
  return (('%.6e'):format(value):gsub('%.?0*e', 'e'):gsub('e([+-])0+', 'e%1'))
end

--- The CPUs of a mask: `CPU 1`, `CPUs 1 and 2`.
local function cpus(mask)
  local names = {}
  for bit = 0, 52 do
    if math.floor(mask / 2 ^ bit) % 2 == 1 then
      table.insert(names, tostring(bit + 1))
    end
  end
  return (#names == 1 and 'CPU ' or 'CPUs ') .. table.concat(names, ', ')
end

--- The instances of a graph below their CPUs, those of a higher priority first.
local function tree_of(graph)
  local at = graph.significance ~= vim.NIL and ' at ' .. level(graph.significance) or ''
  local lines, groups, masks = { graph.name .. at }, {}, {}
  for _, node in ipairs(graph.nodes) do
    local mask = type(node.affinity) == 'number' and node.affinity or 0
    if not groups[mask] then
      groups[mask] = {}
      table.insert(masks, mask)
    end
    table.insert(groups[mask], node)
  end
  table.sort(masks)
  local utilisation = {}
  for _, cpu in ipairs(graph.cpus) do
    utilisation[cpu.mask] = cpu.utilisation
  end
  for _, mask in ipairs(masks) do
    local used = type(utilisation[mask]) == 'number' and ('  %.1f %%'):format(utilisation[mask] * 100) or ''
    table.insert(lines, '  ' .. (mask == 0 and 'no CPU' or cpus(mask)) .. used)
    local longest = 0
    for _, node in ipairs(groups[mask]) do
      longest = math.max(longest, vim.fn.strdisplaywidth(node.instance))
    end
    table.sort(groups[mask], function(a, b)
      local of_a = type(a.priority) == 'number' and a.priority or -1
      local of_b = type(b.priority) == 'number' and b.priority or -1
      return of_a == of_b and a.instance < b.instance or of_a > of_b
    end)
    for _, node in ipairs(groups[mask]) do
      local space = (' '):rep(longest - vim.fn.strdisplaywidth(node.instance))
      local mark = MARKS[node.status] or ' '
      table.insert(lines, (('    %s %s%s  %s'):format(mark, node.instance, space, figure(node)):gsub('%s+$', '')))
    end
  end
  return lines
end

local function of_each(graphs, make)
  local lines = {}
  for index, graph in ipairs(graphs) do
    if index > 1 then
      table.insert(lines, '')
    end
    vim.list_extend(lines, make(graph))
    for _, reason in ipairs(graph.lost) do
      table.insert(lines, 'incomplete: ' .. reason)
    end
  end
  return lines
end

---@type table<string, mauve.Drawing>
M.kinds = {
  graph = {
    method = 'mauve/graph',
    at_cursor = false,
    lines = function(graphs)
      return of_each(graphs, function(graph)
        return lines_of(graph.drawing)
      end)
    end,
    places = graph_places,
  },
  tree = {
    method = 'mauve/graph',
    at_cursor = false,
    is_tree = true,
    lines = function(graphs)
      return of_each(graphs, tree_of)
    end,
    places = graph_places,
  },
  machine = {
    method = 'mauve/stateMachine',
    at_cursor = true,
    lines = drawing_of,
    pin = function(params, machine)
      params.component = machine.component
    end,
    places = function(machine)
      local places = {}
      for _, state in ipairs(machine.states) do
        add(places, state.name, state.location)
      end
      for _, edge in ipairs(machine.edges) do
        add(places, edge.transition, edge.location)
      end
      return places
    end,
  },
  schedule = {
    method = 'mauve/schedule',
    at_cursor = true,
    lines = drawing_of,
    pin = function(params, schedule)
      params.deployment = schedule.deployment
      params.instance = schedule.instance ~= vim.NIL and schedule.instance or nil
    end,
    places = function(schedule)
      local places = {}
      for _, activity in ipairs(schedule.activities) do
        add(places, activity.instance, activity.location)
      end
      return places
    end,
  },
  times = {
    method = 'mauve/executionTimes',
    at_cursor = true,
    lines = drawing_of,
    pin = function(params, times)
      params.codel = times.codel
    end,
    places = function(times)
      local places = {}
      add(places, times.codel:match('[^.]+$'), times.location)
      return places
    end,
  },
}

--- The drawings in windows, by their buffers.
---@type table<integer, { kind: string, source: integer, params: table, places: table, from: integer }>
local shown = {}

local namespace = vim.api.nvim_create_namespace('mauve.drawings')
local lit = vim.api.nvim_create_namespace('mauve.drawings.lit')

--- The colours of marks and figures.
local function colour(buffer)
  vim.api.nvim_set_hl(0, 'MauveHere', { link = 'Search', default = true })
  vim.api.nvim_buf_call(buffer, function()
    vim.cmd([[
      syntax clear
      syntax match MauveMet /✓ [^│┤├·]*/
      syntax match MauveMissed /✗ [^│┤├·]*/
      syntax match MauveUnknown /? [^│┤├·]*/
      syntax match MauveMissed /!\+/
      syntax match MauveTime /█\+/
      syntax match MauveUnknown /^\(incomplete\|no times\): .*/
    ]])
  end)
end

local function write(buffer, lines)
  local current = vim.api.nvim_buf_get_lines(buffer, 0, -1, false)
  if not vim.deep_equal(lines, current) then
    vim.bo[buffer].modifiable = true
    vim.api.nvim_buf_set_lines(buffer, 0, -1, false, lines)
    vim.bo[buffer].modifiable = false
    vim.bo[buffer].modified = false
  end
end

--- Says above a drawing that it is that of an earlier text, or that it is not.
local function mark(buffer, why)
  vim.api.nvim_buf_clear_namespace(buffer, namespace, 0, -1)
  if why then
    vim.api.nvim_buf_set_extmark(buffer, namespace, 0, 0, {
      virt_text = { { ' earlier: ' .. why, 'MauveOlder' } },
      virt_text_pos = 'eol',
    })
  end
end

--- Updates a drawing. One request runs at a time; after a change during a request, another one follows.
local waiting, again = {}, {}
local function update(buffer)
  local drawing = shown[buffer]
  if not drawing or not vim.api.nvim_buf_is_valid(buffer) then
    return
  end
  if waiting[buffer] then
    again[buffer] = true
    return
  end
  local of_source = vim.api.nvim_buf_is_valid(drawing.source)
      and vim.lsp.get_clients({ name = 'mauve', bufnr = drawing.source })
    or {}
  local client = of_source[1] or vim.lsp.get_clients({ name = 'mauve' })[1]
  if not client then
    mark(buffer, 'no server is running')
    return
  end
  waiting[buffer] = true
  local kind = M.kinds[drawing.kind]
  --- Runs when the server has answered.
  local function answered(show)
    waiting[buffer] = nil
    if not shown[buffer] or not vim.api.nvim_buf_is_valid(buffer) then
      return
    end
    show()
    if again[buffer] then
      again[buffer] = nil
      update(buffer)
    end
  end
  mauve.request(client, kind.method, drawing.params, function(answer)
    answered(function()
      local views = {}
      for _, window in ipairs(vim.fn.win_findbuf(buffer)) do
        views[window] = vim.api.nvim_win_call(window, vim.fn.winsaveview)
      end
      write(buffer, kind.lines(answer))
      for window, view in pairs(views) do
        vim.api.nvim_win_call(window, function()
          vim.fn.winrestview(view)
        end)
      end
      drawing.places = kind.places(answer)
      mark(buffer)
      if not shown[vim.api.nvim_get_current_buf()] then
        M.light()
      end
    end)
  end, function(message)
    answered(function()
      mark(buffer, message)
    end)
  end)
end

--- Lights what the current line declares, in all drawings.
function M.light()
  if vim.tbl_isempty(shown) then
    return
  end
  local uri, line = vim.uri_from_bufnr(0), vim.api.nvim_win_get_cursor(0)[1] - 1
  for buffer, drawing in pairs(shown) do
    vim.api.nvim_buf_clear_namespace(buffer, lit, 0, -1)
    for word, place in pairs(drawing.places) do
      if place.uri == uri and place.range.start.line == line then
        local pattern = ('%%f[%%w_]%s%%f[^%%w_]'):format(vim.pesc(word))
        for number, text in ipairs(vim.api.nvim_buf_get_lines(buffer, 0, -1, false)) do
          local from, to = text:find(pattern)
          while from do
            vim.api.nvim_buf_set_extmark(buffer, lit, number - 1, from - 1, { end_col = to, hl_group = 'MauveHere' })
            from, to = text:find(pattern, to + 1)
          end
        end
      end
    end
  end
end

--- Goes to the source of the word at the cursor, in the window that the drawing was opened from.
local function go_to_source(buffer)
  local drawing = shown[buffer]
  local line, column = vim.api.nvim_get_current_line(), vim.fn.col('.')
  local place
  -- The word at the cursor, otherwise the only one in this line that has a place.
  for from, word in line:gmatch('()([%w_]+)') do
    local found = drawing.places[word]
    if found and (column >= from and column < from + #word) then
      place = found
      break
    elseif found and not place then
      place = found
    end
  end
  if not place then
    vim.notify('mauve: nothing with a source here', vim.log.levels.INFO)
    return
  end
  local window = drawing.from
  if vim.api.nvim_win_is_valid(window) and window ~= vim.api.nvim_get_current_win() then
    vim.api.nvim_set_current_win(window)
  end
  local client = vim.lsp.get_clients({ name = 'mauve' })[1]
  local encoding = client and client.offset_encoding or 'utf-16'
  if vim.lsp.util.show_document then
    vim.lsp.util.show_document(place, encoding, { focus = true })
  else
    vim.lsp.util.jump_to_location(place, encoding, true)
  end
end

--- Opens a window for a drawing; returns it.
local function open(buffer, kind, where)
  if where == 'float' then
    local width, height = math.floor(vim.o.columns * 0.9), math.floor(vim.o.lines * 0.8)
    return vim.api.nvim_open_win(buffer, true, {
      relative = 'editor',
      width = width,
      height = height,
      col = math.floor((vim.o.columns - width) / 2),
      row = math.floor((vim.o.lines - height) / 2),
      border = 'rounded',
      title = ' MAUVE ' .. kind .. ' ',
      style = 'minimal',
    })
  end
  vim.cmd(M.kinds[kind].is_tree and 'topleft 44vsplit' or 'botright split')
  local window = vim.api.nvim_get_current_win()
  vim.api.nvim_win_set_buf(window, buffer)
  return window
end

--- Draws in the browser instead.
local function browse(client, kind, params)
  params.drawing = 'svg'
  mauve.request(client, M.kinds[kind].method, params, function(answer)
    local drawing = answer.drawing or answer[1] and answer[1].drawing
    if type(drawing) ~= 'string' then
      vim.notify('mauve: ' .. table.concat(reasons(answer), '; '), vim.log.levels.ERROR)
      return
    end
    local path = vim.fn.tempname() .. '.svg'
    vim.fn.writefile(vim.split(drawing, '\n', { plain = true }), path)
    M.last_file = path
    vim.ui.open(path)
  end)
end

--- Shows a drawing of what is in the current buffer, or at its cursor.
---@param kind string  one of `M.kinds`
---@param where? 'split'|'float'|'browser'
function M.show(kind, where)
  where = where or 'split'
  if not vim.list_contains({ 'split', 'float', 'browser' }, where) then
    vim.notify(('mauve: no place "%s"; there are: split, float, browser'):format(where), vim.log.levels.ERROR)
    return
  end
  local source = vim.api.nvim_get_current_buf()
  local client = mauve.client(source)
  if not client then
    return
  end
  local params = { textDocument = vim.lsp.util.make_text_document_params(source), drawing = 'text' }
  if M.kinds[kind].at_cursor then
    params.position = vim.lsp.util.make_position_params(0, client.offset_encoding).position
  end
  if where == 'browser' and not M.kinds[kind].is_tree then
    browse(client, kind, params)
    return
  end
  local from = vim.api.nvim_get_current_win()
  mauve.request(client, M.kinds[kind].method, params, function(answer)
    local buffer = vim.api.nvim_create_buf(false, true)
    vim.bo[buffer].bufhidden = 'wipe'
    vim.api.nvim_buf_set_name(buffer, ('mauve://%s/%d'):format(kind, buffer))
    local lines = M.kinds[kind].lines(answer)
    local window = open(buffer, kind, where)
    vim.wo[window][0].wrap = false
    vim.wo[window][0].number = false
    vim.wo[window][0].relativenumber = false
    vim.wo[window][0].signcolumn = 'no'
    vim.wo[window][0].foldcolumn = '0'
    vim.wo[window][0].list = false
    vim.wo[window][0].spell = false
    if where ~= 'float' and not M.kinds[kind].is_tree then
      vim.api.nvim_win_set_height(window, math.max(3, math.min(#lines, math.floor(vim.o.lines / 2))))
    end
    vim.bo[buffer].filetype = 'mauve-drawing'
    colour(buffer)
    write(buffer, lines)
    if M.kinds[kind].pin then
      M.kinds[kind].pin(params, answer)
      params.position = nil
    end
    shown[buffer] = { kind = kind, source = source, params = params, places = M.kinds[kind].places(answer), from = from }
    vim.keymap.set('n', 'q', '<Cmd>close<CR>', { buffer = buffer, nowait = true, desc = 'Close the drawing' })
    vim.keymap.set('n', '<CR>', function()
      go_to_source(buffer)
    end, { buffer = buffer, desc = 'Go to the source of the word at the cursor' })
    vim.keymap.set('n', '<2-LeftMouse>', function()
      go_to_source(buffer)
    end, { buffer = buffer, desc = 'Go to the source of the word at the cursor' })
    vim.keymap.set('n', 'gx', function()
      if not M.kinds[kind].is_tree then
        browse(client, kind, vim.deepcopy(params))
      end
    end, { buffer = buffer, desc = 'Show the drawing in the browser' })
    vim.api.nvim_create_autocmd('BufWipeout', {
      buffer = buffer,
      callback = function()
        shown[buffer] = nil
      end,
    })
  end)
end

--- Draws again what is shown, soon: several changes are drawn once.
local timer
function M.update()
  if vim.tbl_isempty(shown) then
    return
  end
  if not timer then
    timer = vim.uv.new_timer()
  end
  timer:start(40, 0, vim.schedule_wrap(function()
    for buffer in pairs(shown) do
      update(buffer)
    end
  end))
end

return M
