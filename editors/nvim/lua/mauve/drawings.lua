-- Drawings in windows: the architecture, a state machine, a schedule, probabilities, chains, the times of a codel and the figures before
-- and after, in characters as the server draws them, and the instances as a tree. They follow the text while it is edited.

local mauve = require('mauve')

local M = {}

--- What can be shown. Each asks the server for a method, and makes lines and places of the answer.
---@class mauve.Drawing
---@field method string
---@field at_cursor boolean  whether it shows what is at the cursor
---@field is_tree? boolean
---@field names? string[]  the fields of the answer that, as parameters, ask for the same thing again

---@type table<string, mauve.Drawing>
M.kinds = {
  graph = { method = 'mauve/graph', at_cursor = false },
  tree = { method = 'mauve/graph', at_cursor = false, is_tree = true },
  machine = { method = 'mauve/stateMachine', at_cursor = true, names = { 'component' } },
  schedule = { method = 'mauve/schedule', at_cursor = true, names = { 'deployment', 'instance' } },
  probability = { method = 'mauve/probability', at_cursor = true, names = { 'deployment', 'instance' } },
  chains = { method = 'mauve/chains', at_cursor = true, names = { 'deployment' } },
  -- Compared with the state when it was opened, which the server has in its answer.
  whatif = { method = 'mauve/whatIf', at_cursor = true, names = { 'deployment', 'before' } },
  times = { method = 'mauve/executionTimes', at_cursor = true, names = { 'codel', 'instance' } },
}

--- The answers to a request: the method for graphs answers with a list.
local function each(answer)
  return answer[1] and answer or { answer }
end

--- The lines that are shown: drawings, and why something is missing.
---@param kind mauve.Drawing
---@return string[]
local function lines_of(kind, answer)
  local lines = {}
  for index, drawn in ipairs(each(answer)) do
    local text = kind.is_tree and drawn.tree or drawn.drawing
    if type(text) == 'string' then
      vim.list_extend(lines, vim.split((index > 1 and '\n' or '') .. text:gsub('\n+$', ''), '\n', { plain = true }))
    end
    for why, reasons in pairs({ ['incomplete: '] = drawn.lost or {}, ['no times: '] = drawn.reasons or {} }) do
      for _, reason in ipairs(reasons) do
        table.insert(lines, why .. reason)
      end
    end
  end
  return lines
end

--- The places in the sources, by the words that stand for them in a drawing: of the first that has one. Null is `vim.NIL`.
---@return table<string, lsp.Location>
local function places_of(answer)
  local places = {}
  local function add(word, place)
    if type(word) == 'string' and type(place) == 'table' and not places[word] then
      places[word] = place
    end
  end
  for _, drawn in ipairs(each(answer)) do
    for _, list in ipairs({ 'nodes', 'states', 'edges', 'activities', 'chains', 'hops', 'rows' }) do
      for _, it in ipairs(drawn[list] or {}) do
        add(it.instance or it.name or it.transition, type(it.activity) == 'table' and it.activity or it.location)
        add(it.component, it.location)
      end
    end
    add(type(drawn.codel) == 'string' and drawn.codel:match('[^.]+$'), drawn.location)
  end
  return places
end

--- The drawings in windows, by their buffers.
---@type table<integer, { kind: string, source: integer, params: table, places: table, from: integer, deployment: string? }>
local shown = {}

local namespace = vim.api.nvim_create_namespace('mauve.drawings')
local lit = vim.api.nvim_create_namespace('mauve.drawings.lit')

--- The colours of marks and figures.
local function colour(buffer)
  vim.api.nvim_set_hl(0, 'MauveHere', { link = 'Search', default = true })
  vim.api.nvim_buf_call(buffer, function()
    vim.cmd([[
      syntax clear
      syntax match MauveMissed /!\+/
      syntax match MauveMet /✓ [^│┤├·,;]*/
      syntax match MauveTight /\(! [0-9≤]\|^! \)[^│┤├·,;]*/
      syntax match MauveMissed /✗ [^│┤├·,;]*/
      syntax match MauveUnknown /? [^│┤├·,;]*/
      syntax match MauveTime /·\+/
      syntax match MauveUnknown /^\(incomplete\|no times\): .*/
    ]])
  end)
end

--- Replaces the lines of a buffer that is not edited.
function M.write(buffer, lines)
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

--- The columns of a window that a drawing may have.
local function columns_of(window)
  return window and vim.api.nvim_win_get_width(window) or vim.o.columns
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
  drawing.params.columns = columns_of(vim.fn.win_findbuf(buffer)[1])
  mauve.request(client, kind.method, drawing.params, function(answer)
    answered(function()
      local views = {}
      for _, window in ipairs(vim.fn.win_findbuf(buffer)) do
        views[window] = vim.api.nvim_win_call(window, vim.fn.winsaveview)
      end
      M.write(buffer, lines_of(kind, answer))
      for window, view in pairs(views) do
        vim.api.nvim_win_call(window, function()
          vim.fn.winrestview(view)
        end)
      end
      drawing.places = places_of(answer)
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

--- The source of the word at the cursor of a drawing, otherwise of the first one in this line that has a source.
local function place_at_cursor(drawing)
  local line, column = vim.api.nvim_get_current_line(), vim.fn.col('.')
  local place
  for from, word in line:gmatch('()([%w_]+)') do
    local found = drawing.places[word]
    if found and (column >= from and column < from + #word) then
      return found
    end
    place = place or found
  end
  return place
end

--- Goes to the source of the word at the cursor, in the window that the drawing was opened from.
local function go_to_source()
  local drawing = shown[vim.api.nvim_get_current_buf()]
  local place = place_at_cursor(drawing)
  if not place then
    vim.notify('mauve: nothing with a source here', vim.log.levels.INFO)
    return
  end
  local window = drawing.from
  if vim.api.nvim_win_is_valid(window) and window ~= vim.api.nvim_get_current_win() then
    vim.api.nvim_set_current_win(window)
  end
  mauve.go_to(place)
end

--- Opens a window for a drawing.
local function open(buffer, kind, where, height)
  local config
  if where == 'float' then
    local width, rows = math.floor(vim.o.columns * 0.9), math.floor(vim.o.lines * 0.8)
    config = {
      relative = 'editor',
      width = width,
      height = rows,
      col = math.floor((vim.o.columns - width) / 2),
      row = math.floor((vim.o.lines - rows) / 2),
      border = 'rounded',
      title = ' MAUVE ' .. kind .. ' ',
    }
  elseif kind == 'tree' then
    config = { split = 'left', win = -1, width = 44 }
  else
    config = { split = 'below', win = -1, height = math.max(3, math.min(height, math.floor(vim.o.lines / 2))) }
  end
  config.style = 'minimal'
  vim.wo[vim.api.nvim_open_win(buffer, true, config)][0].wrap = false
end

--- Opens a buffer with lines that are not edited, in a window of its own; `go` is called by <CR> and a double click.
---@return integer
function M.new(kind, where, height, go)
  local buffer = vim.api.nvim_create_buf(false, true)
  vim.bo[buffer].bufhidden = 'wipe'
  vim.api.nvim_buf_set_name(buffer, ('mauve://%s/%d'):format(kind, buffer))
  open(buffer, kind, where, height)
  vim.bo[buffer].filetype = 'mauve-drawing'
  colour(buffer)
  vim.keymap.set('n', 'q', '<Cmd>close<CR>', { buffer = buffer, nowait = true, desc = 'Close the window' })
  for _, key in ipairs({ '<CR>', '<2-LeftMouse>' }) do
    vim.keymap.set('n', key, go, { buffer = buffer, desc = 'Go to the source of the word at the cursor' })
  end
  return buffer
end

--- Draws in the browser instead.
local function browse(client, kind, params)
  params.drawing = 'svg'
  mauve.request(client, M.kinds[kind].method, params, function(answer)
    local drawing = each(answer)[1].drawing
    if type(drawing) ~= 'string' then
      vim.notify('mauve: ' .. table.concat(lines_of(M.kinds[kind], answer), '; '), vim.log.levels.ERROR)
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
---@param values? string[]  other values, for `whatif`
function M.show(kind, where, values)
  where = where or 'split'
  if not vim.list_contains({ 'split', 'float', 'browser' }, where) then
    vim.notify(('mauve: no place "%s"; there are: split, float, browser'):format(where), vim.log.levels.ERROR)
    return
  end
  local source, from = vim.api.nvim_get_current_buf(), vim.api.nvim_get_current_win()
  local within = shown[source]
  local client = mauve.client(source)
  if not client then
    return
  end
  local params = { drawing = 'text', values = values, columns = vim.o.columns }
  if within then
    -- In a drawing: of what the word at the cursor stands for, otherwise of the deployment that is drawn.
    local place = M.kinds[kind].at_cursor and place_at_cursor(within)
    if place == nil and not vim.list_contains(M.kinds[kind].names, 'deployment') then
      vim.notify('mauve: put the cursor on a name of the drawing', vim.log.levels.ERROR)
      return
    end
    source, from = within.source, within.from
    params.textDocument = place and { uri = place.uri } or within.params.textDocument
    params.position = place and place.range.start or nil
    local name = M.kinds[kind].at_cursor and 'deployment' or 'name'
    params[name] = not place and (within.deployment or within.params.deployment) or nil
  else
    params.textDocument = vim.lsp.util.make_text_document_params(source)
    if M.kinds[kind].at_cursor then
      params.position = vim.lsp.util.make_position_params(0, client.offset_encoding).position
    end
  end
  if where == 'browser' and not M.kinds[kind].is_tree then
    browse(client, kind, params)
    return
  end
  mauve.request(client, M.kinds[kind].method, params, function(answer)
    local lines = lines_of(M.kinds[kind], answer)
    local buffer = M.new(kind, where, #lines, go_to_source)
    M.write(buffer, lines)
    -- By their names, since edits move positions.
    for _, name in ipairs(M.kinds[kind].names or {}) do
      params[name], params.position = answer[name] ~= vim.NIL and answer[name] or nil, nil
    end
    shown[buffer] = { kind = kind, source = source, params = params, places = places_of(answer), from = from }
    -- That of a graph is called `name`.
    shown[buffer].deployment = answer.deployment or each(answer)[1].name
    if columns_of(vim.api.nvim_get_current_win()) ~= params.columns then
      update(buffer)
    end
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

--- Compares the figures of the deployment at the cursor, with these values, with those of now; or, where they are shown, with those
--- of the time when they were opened.
---@param words string[]  `imu.period=5`, `nav.plan=12ms`; one without `=` is the place
function M.what_if(words)
  local where, values = nil, {}
  for _, word in ipairs(words) do
    if word:find('=', 1, true) then
      table.insert(values, word)
    else
      where = word
    end
  end
  local given = #values > 0 and values or nil
  for buffer, drawing in pairs(shown) do
    if drawing.kind == 'whatif' and not where then
      drawing.params.values = given
      update(buffer)
      return
    end
  end
  M.show('whatif', where, given)
end

--- The file that a drawing is of; a buffer that is none stands for itself.
---@param buffer integer
function M.source(buffer)
  return shown[buffer] and shown[buffer].source or buffer
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
