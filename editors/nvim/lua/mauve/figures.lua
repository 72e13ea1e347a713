-- Figures at the ends of lines, each in the highlight group of its status. Neovim's own inlay hints have one group, stand within
-- the text, and are switched off for this server.

local mauve = require('mauve')

local M = {}

local namespace = vim.api.nvim_create_namespace('mauve.figures')
local method = 'textDocument/inlayHint'

-- What each status looks like unless the user or a colour scheme says otherwise.
local groups = {
  met = { 'MauveMet', 'DiagnosticOk' },
  tight = { 'MauveTight', 'DiagnosticWarn' },
  missed = { 'MauveMissed', 'DiagnosticError' },
  unknown = { 'MauveUnknown', 'DiagnosticHint' },
  older = { 'MauveOlder', 'Comment' },
  time = { 'MauveTime', 'LspInlayHint' },
  value = { 'MauveValue', 'LspInlayHint' },
}

-- So many milliseconds after a change without new figures, those on the screen are marked as older.
local patience = 500

---@class mauve.Figures  The figures of a buffer.
---@field hints table[]  What the server said last.
---@field marks table<integer, integer>  The extmarks of the lines with hints.
---@field asking? boolean  Whether an answer is awaited.
---@field again? boolean  Whether to ask again then.
---@field waiting? uv.uv_timer_t  Marks the figures as older; stopped by the answer for the current text.
---@field late? boolean  Whether they are those of an earlier text.

---@type table<integer, mauve.Figures>
local states = {}

--- Links the highlight groups, for those that nobody has set.
function M.link()
  for _, group in pairs(groups) do
    vim.api.nvim_set_hl(0, group[1], { link = group[2], default = true })
  end
end

--- The highlight group of a status.
---@param status string
function M.group(status)
  return (groups[status] or groups.value)[1]
end

--- The windows with a buffer: the columns of their text, and whether lines are wrapped.
local function views_of(buffer)
  return vim.tbl_map(function(window)
    local width = vim.api.nvim_win_get_width(window) - vim.fn.getwininfo(window)[1].textoff
    return { width = width, wraps = vim.wo[window].wrap and width > 0 }
  end, vim.fn.win_findbuf(buffer))
end

--- The columns behind the end of a line that are in sight in all windows; nothing where there is no window.
local function room_behind(line, views)
  local least
  local whole = vim.fn.strdisplaywidth(line)
  for _, view in ipairs(views) do
    local used = view.wraps and whole > view.width and (whole - 1) % view.width + 1 or whole
    least = math.min(least or math.huge, view.width - used)
  end
  return least
end

-- What stands for a hint where there is no room for more.
local marks = { ['✓'] = true, ['!'] = true, ['✗'] = true, ['?'] = true, ['–'] = true, ['…'] = true }

--- A label, marked as that of an earlier text as the server does it: `… 53 / 100 ms`.
local function as_older(label)
  local mark, rest = label:match('^(%S+) ?(.*)$')
  return vim.trim('… ' .. (marks[mark] and rest or label))
end

--- What is drawn of the hints of a line, in at most so many columns: in fewer and fewer words, without the last hints, and at last
--- a mark. Without a known room, the labels. Also returns whether it fits.
local function chunks_of(hints, room, is_late)
  local most = 1
  for _, hint in ipairs(hints) do
    most = math.max(most, #(hint.data and hint.data.labels or {}) + (is_late and 1 or 0))
  end
  local function chunks(count, by)
    -- One column is left at the end of the line. The last one of a window may be empty.
    local shown, width, has_mark = {}, 0, false
    for index = 1, count do
      local hint = hints[index]
      local labels = room and hint.data and hint.data.labels or { hint.label }
      local label, status = labels[math.min(by, #labels)], hint.data and hint.data.status
      if is_late and status ~= 'older' and status ~= 'value' then
        -- As the server marks them.
        label, status = by > #labels and '…' or as_older(label), 'older'
      end
      has_mark = has_mark or marks[label]
      shown[index] = { ' ' .. label .. ' ', M.group(status) }
      width = width + vim.fn.strdisplaywidth(shown[index][1])
    end
    return shown, width, has_mark
  end
  local found, width = chunks(#hints, 1)
  for count = #hints, 1, -1 do
    for by = 1, most do
      if room and width > room then
        local shorter, less, has_mark = chunks(count, by)
        if count == 1 or not has_mark then
          found, width = shorter, less
        end
      end
    end
  end
  return found, not room or width <= room
end

local function draw(buffer)
  local state = states[buffer]
  if not (state and vim.api.nvim_buf_is_loaded(buffer)) then
    return
  end
  local lines = {}
  for _, hint in ipairs(state.hints) do
    -- Neovim has moved those that are drawn with their lines.
    local mark = state.marks[hint.position.line]
    local line = mark and vim.api.nvim_buf_get_extmark_by_id(buffer, namespace, mark, {})[1] or hint.position.line
    hint.position.line = line
    lines[line] = lines[line] or {}
    table.insert(lines[line], hint)
  end
  vim.api.nvim_buf_clear_namespace(buffer, namespace, 0, -1)
  state.marks = {}
  local views = views_of(buffer)
  local function draw_line(number, of_line)
    local line = vim.api.nvim_buf_get_lines(buffer, number, number + 1, false)[1]
    if line then
      local chunks, fits = chunks_of(of_line, room_behind(line, views), state.late)
      -- Where the last row of the line is full, the figure stands in the indentation; without one, it begins the next row, as a
      -- part of the text.
      local indent = vim.fn.strdisplaywidth(line:match('^%s*'))
      local is_before = not fits and indent > 1
      if is_before then
        local first = chunks_of(of_line, indent, state.late)[1]
        chunks = { { vim.trim(first[1]), first[2] } }
      end
      state.marks[number] = vim.api.nvim_buf_set_extmark(buffer, namespace, number, (fits or is_before) and 0 or #line, {
        virt_text = chunks,
        virt_text_pos = is_before and 'overlay' or fits and 'eol' or 'inline',
        hl_mode = 'combine',
        -- Less than that of diagnostics, whose messages follow.
        priority = 1000,
      })
    end
  end
  -- There, tabs are as wide as in its windows.
  vim.api.nvim_buf_call(buffer, function()
    for number, of_line in pairs(lines) do
      draw_line(number, of_line)
    end
  end)
end

--- Draws the figures of all buffers anew, since windows have other widths.
function M.redraw()
  vim.tbl_map(draw, vim.tbl_keys(states))
end

--- The figures of a buffer are those of its text.
local function confirm(state)
  if state.waiting then
    state.waiting:stop()
    state.waiting:close()
  end
  state.waiting, state.late = nil, nil
end

--- From a change on, the figures on the screen may be those of an earlier text.
local function expect(buffer)
  local state = states[buffer]
  if not state then
    return
  end
  -- An answer that is on its way may be older than the change.
  state.again = state.asking
  if not state.waiting then
    local timer
    timer = vim.defer_fn(function()
      -- It may have been stopped in the meantime.
      if state.waiting == timer then
        state.waiting, state.late = nil, true
        draw(buffer)
      end
    end, patience)
    state.waiting = timer
  end
end

local function ask(buffer, client)
  local state = states[buffer]
  if not state or not vim.api.nvim_buf_is_loaded(buffer) then
    return
  end
  local tick = vim.api.nvim_buf_get_changedtick(buffer)
  state.asking, state.again = true, false
  local function answered(_, hints)
    state.asking = false
    -- Those of another text stand at other places. Without an answer, the old ones stay: the server has a refresh requested.
    if hints and vim.api.nvim_buf_is_loaded(buffer) and vim.api.nvim_buf_get_changedtick(buffer) == tick then
      state.hints, state.marks = hints, {}
      if not state.again then
        confirm(state)
      end
      draw(buffer)
    end
    if state.again then
      ask(buffer, client)
    end
  end
  local params = {
    textDocument = vim.lsp.util.make_text_document_params(buffer),
    range = {
      start = { line = 0, character = 0 },
      ['end'] = { line = vim.api.nvim_buf_line_count(buffer), character = 0 },
    },
  }
  -- Changes that wait are sent before a request.
  state.asking = mauve.call(client, 'request', method, params, answered, buffer)
end

--- Draws the figures of a buffer anew.
local function update(buffer, client)
  if not vim.list_contains(mauve.filetypes, vim.bo[buffer].filetype) then
    return
  end
  states[buffer] = states[buffer] or { hints = {}, marks = {} }
  if states[buffer].asking then
    states[buffer].again = true
  else
    ask(buffer, client)
  end
end

--- Draws the figures of all buffers of a client anew: those of a deployment change with other models, and with tables.
---@param client vim.lsp.Client
function M.update(client)
  for buffer in pairs(client.attached_buffers) do
    if vim.api.nvim_buf_is_loaded(buffer) then
      update(buffer, client)
    end
  end
end

--- Draws the figures of a buffer from now on, as long as the client is attached to it.
---@param client vim.lsp.Client
---@param buffer integer
function M.attach(client, buffer)
  M.update(client)
  local function changed()
    if not client.attached_buffers[buffer] then
      return true
    end
    vim.tbl_map(expect, vim.tbl_keys(client.attached_buffers))
    vim.schedule(function()
      M.update(client)
    end)
  end
  vim.api.nvim_buf_attach(buffer, false, {
    on_lines = changed,
    on_reload = function()
      changed()
    end,
  })
end

--- Takes the figures of a buffer away.
---@param buffer integer
function M.detach(buffer)
  if states[buffer] then
    confirm(states[buffer])
    states[buffer] = nil
  end
  if vim.api.nvim_buf_is_loaded(buffer) then
    vim.api.nvim_buf_clear_namespace(buffer, namespace, 0, -1)
  end
end

return M
