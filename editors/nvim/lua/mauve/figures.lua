-- Figures at the ends of lines, each in the highlight group of its status. Neovim's own inlay hints have one group, stand within
-- the text, and are switched off for this server.

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

-- Of each buffer: whether an answer is awaited, and whether to ask again then.
local asking = {}

--- Links the highlight groups, for those that nobody has set.
function M.link()
  for _, group in pairs(groups) do
    vim.api.nvim_set_hl(0, group[1], { link = group[2], default = true })
  end
end

local function draw(buffer, hints)
  local lines = {}
  for _, hint in ipairs(hints) do
    local line = hint.position.line
    local group = groups[vim.tbl_get(hint, 'data', 'status')] or groups.value
    lines[line] = lines[line] or {}
    table.insert(lines[line], { ' ' .. hint.label .. ' ', group[1] })
  end
  local last = vim.api.nvim_buf_line_count(buffer)
  vim.api.nvim_buf_clear_namespace(buffer, namespace, 0, -1)
  for line, chunks in pairs(lines) do
    if line < last then
      vim.api.nvim_buf_set_extmark(buffer, namespace, line, 0, { virt_text = chunks, virt_text_pos = 'eol', hl_mode = 'combine' })
    end
  end
end

local function ask(buffer, client)
  if not vim.api.nvim_buf_is_loaded(buffer) then
    asking[buffer] = nil
    return
  end
  local tick = vim.api.nvim_buf_get_changedtick(buffer)
  asking[buffer] = {}
  local function answered(_, hints)
    local again = asking[buffer] and asking[buffer].again
    asking[buffer] = nil
    -- Those of another text stand at other places. Without an answer, the old ones stay: the server has a refresh requested.
    if hints and vim.api.nvim_buf_is_loaded(buffer) and vim.api.nvim_buf_get_changedtick(buffer) == tick then
      draw(buffer, hints)
    end
    if again then
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
  -- Functions of a client are methods since 0.11. Changes that wait are sent before a request.
  local sent
  if vim.fn.has('nvim-0.11') == 1 then
    sent = client:request(method, params, answered, buffer)
  else
    sent = client.request(method, params, answered, buffer)
  end
  if not sent then
    asking[buffer] = nil
  end
end

--- Draws the figures of a buffer anew.
local function update(buffer, client)
  if asking[buffer] then
    asking[buffer].again = true
  elseif vim.bo[buffer].filetype == 'mauve' then
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
  vim.api.nvim_buf_attach(buffer, false, {
    on_lines = function()
      if not client.attached_buffers[buffer] then
        return true
      end
      vim.schedule(function()
        M.update(client)
      end)
    end,
    on_reload = function()
      vim.schedule(function()
        M.update(client)
      end)
    end,
  })
end

--- Takes the figures of a buffer away.
---@param buffer integer
function M.detach(buffer)
  asking[buffer] = nil
  if vim.api.nvim_buf_is_loaded(buffer) then
    vim.api.nvim_buf_clear_namespace(buffer, namespace, 0, -1)
  end
end

return M
