-- The problems of all files in a window, the worst first, each with its fixes: <CR> goes to a problem, or applies a fix.

local mauve = require('mauve')

local M = {}

-- So many problems are listed, and the first of them with so many fixes: the server computes what each would give.
local MOST, WITH_FIXES, FIXES = 30, 4, 3

-- By the marks of figures. An error leaves everything without a proof.
local ranks = { error = 1, ['✗'] = 2, ['?'] = 3, ['!'] = 4, warning = 5 }

---@class mauve.Problem
---@field order number  The rank, then the response time as a part of the deadline: the greatest one first.
---@field text string
---@field place lsp.Location
---@field why? string
---@field cause lsp.Location  Where fixes are offered.

--- The problems, from the graphs of all deployments and the diagnostics of all files: activities whose figure is not met with
--- slack, with the diagnostics that explain them, and all other errors and warnings.
---@return mauve.Problem[]
local function problems_of(graphs, reports)
  local problems, diagnostics = {}, {}
  for _, report in ipairs(reports) do
    for _, it in ipairs(report.items or {}) do
      local places = { { uri = report.uri, range = it.range } }
      for _, related in ipairs(it.relatedInformation or {}) do
        table.insert(places, related.location)
      end
      if it.severity <= vim.diagnostic.severity.WARN then
        table.insert(diagnostics, { places = places, it = it })
      end
    end
  end
  local function add(rank, part, text, place, diagnostic)
    local why, cause = diagnostic and diagnostic.it.message, diagnostic and diagnostic.places[1] or place
    table.insert(problems, { order = rank - math.min(part, 1e3) / 1e4, text = text, place = place, why = why, cause = cause })
  end
  local function add_activity(node, figure)
    local explanation
    for _, diagnostic in ipairs(diagnostics) do
      for _, place in ipairs(diagnostic.places) do
        if place.uri == node.activity.uri and vim.deep_equal(place.range.start, node.activity.range.start) then
          explanation, diagnostic.is_said = explanation or diagnostic, true
        end
      end
    end
    local has_part = type(node.response) == 'number' and type(node.deadline) == 'number'
    local part = has_part and node.response / math.max(node.deadline, 1e-9) or math.huge
    local text = figure:gsub('^%S+', '%0 ' .. node.instance, 1)
    add(ranks[figure:match('^%S+')], part, text, node.activity, explanation)
  end
  for _, graph in ipairs(graphs) do
    for _, node in ipairs(graph.nodes) do
      if type(node.figure) == 'string' and ranks[node.figure:match('^%S+')] and type(node.activity) == 'table' then
        add_activity(node, node.figure)
      end
    end
  end
  for _, diagnostic in ipairs(diagnostics) do
    if not diagnostic.is_said then
      local is_error = diagnostic.it.severity == vim.diagnostic.severity.ERROR
      local text = (is_error and '✗ ' or '! ') .. tostring(diagnostic.it.code)
      add(is_error and ranks.error or ranks.warning, 0, text, diagnostic.places[1], diagnostic)
    end
  end
  table.sort(problems, function(one, other)
    return one.order < other.order or one.order == other.order and one.text < other.text
  end)
  return vim.list_slice(problems, 1, MOST)
end

---@type { buffer: integer, from: integer, rows: table[], asked: integer }?
local shown

local function write(problems, fixes)
  local lines, rows = { 'MAUVE ' .. mauve.verdict(), #problems == 0 and 'No problems' or nil }, {}
  local function add(line, problem, fix)
    table.insert(lines, (line:gsub('[%z\r\n]', ' ')))
    rows[#lines] = { place = fix and problem.cause or problem.place, fix = fix }
  end
  for _, problem in ipairs(problems) do
    local path = vim.fn.fnamemodify(vim.uri_to_fname(problem.place.uri), ':~:.')
    add(('%s  %s:%d'):format(problem.text, path, problem.place.range.start.line + 1), problem)
    if problem.why then
      add('    ' .. problem.why, problem)
    end
    for _, fix in ipairs(vim.list_slice(fixes[problem] or {}, 1, FIXES)) do
      add('    → ' .. fix.title, problem, fix.title)
    end
  end
  require('mauve.drawings').write(shown.buffer, lines)
  shown.rows = rows
end

--- Lists the problems again, if their window is open.
function M.update()
  local client = vim.lsp.get_clients({ name = 'mauve' })[1]
  if not client or not shown then
    return
  end
  shown.asked = shown.asked + 1
  local asked = shown.asked
  coroutine.wrap(function()
    local here = coroutine.running()
    local function ask(method, params)
      local function answered(answer)
        -- After another update, this one ends.
        if shown and shown.asked == asked then
          assert(coroutine.resume(here, answer or {}))
        end
      end
      mauve.request(client, method, params, answered, function()
        answered()
      end)
      return coroutine.yield()
    end
    local graphs, fixes = {}, {}
    for _, workspace in ipairs(ask('mauve/status').workspaces or {}) do
      for _, root in ipairs(workspace.roots) do
        local document = { uri = vim.uri_from_fname(root) }
        vim.list_extend(graphs, ask('mauve/graph', { textDocument = document, drawing = 'dot' }))
      end
    end
    local reports = ask('workspace/diagnostic', { previousResultIds = {} }).items or {}
    local problems = problems_of(graphs, reports)
    write(problems, fixes)
    for _, problem in ipairs(vim.list_slice(problems, 1, WITH_FIXES)) do
      local context = { diagnostics = {}, only = { 'quickfix' } }
      local document = { uri = problem.cause.uri }
      fixes[problem] = ask('textDocument/codeAction', { textDocument = document, range = problem.cause.range, context = context })
      write(problems, fixes)
    end
  end)()
end

--- Goes to the problem at the cursor, or applies the fix.
local function choose()
  local row = shown.rows[vim.fn.line('.')]
  if row then
    if vim.api.nvim_win_is_valid(shown.from) then
      vim.api.nvim_set_current_win(shown.from)
    end
    mauve.go_to(row.place)
  end
  local function is_chosen(action)
    return action.title == row.fix
  end
  if row and row.fix then
    local context = { diagnostics = {}, only = { 'quickfix' } }
    vim.lsp.buf.code_action({ context = context, apply = true, filter = is_chosen })
  end
end

--- `:Mauve problems`, and a click on the verdict in the status line.
function M.show()
  local from = vim.api.nvim_get_current_win()
  if not mauve.client(0) then
    return
  elseif shown then
    vim.api.nvim_set_current_win(vim.fn.win_findbuf(shown.buffer)[1] or from)
  else
    shown = { buffer = require('mauve.drawings').new('problems', 'split', 12, choose), from = from, rows = {}, asked = 0 }
    vim.wo.wrap, vim.wo.linebreak, vim.wo.breakindent = true, true, true
    vim.api.nvim_create_autocmd('BufWipeout', {
      buffer = shown.buffer,
      callback = function()
        shown = nil
      end,
    })
  end
  M.update()
end

return M
