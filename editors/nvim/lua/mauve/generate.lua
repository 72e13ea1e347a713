-- Orocos packages: what would be done is shown, and done by the server when the user says so.

local mauve = require('mauve')

local M = {}

--- What code actions and lenses execute: with the address of a file, and the name of a deployment.
M.COMMAND = 'mauve.generateOrocos'

--- Tells the server that the client has the command.
---@param capabilities lsp.ClientCapabilities
function M.extend(capabilities)
  capabilities.experimental = capabilities.experimental or {}
  local commands = capabilities.experimental.commands or {}
  if not vim.list_contains(commands, M.COMMAND) then
    table.insert(commands, M.COMMAND)
  end
  capabilities.experimental.commands = commands
end

---@class mauve.Generated  What the server answers.
---@field folder string
---@field files { path: string, action: 'create'|'change'|'remove' }[]
---@field warning string?  what stays, though the models have left it behind
---@field nothing string?  that nothing changes
---@field edit lsp.WorkspaceEdit

--- Where a file is behind all links, be it there or not.
local function real(path)
  local found = vim.uv.fs_realpath(path)
  if found then
    return found
  end
  local folder = vim.fs.dirname(path)
  return folder ~= path and vim.fs.joinpath(real(folder), vim.fs.basename(path)) or path
end

--- The texts that files get, by their paths behind all links.
---@param generated mauve.Generated
---@return table<string, string>
local function texts_of(generated)
  local texts = {}
  for _, change in ipairs(generated.edit.documentChanges) do
    if not change.kind then
      -- It is all that the file is to hold.
      texts[real(vim.uri_to_fname(change.textDocument.uri))] = change.edits[1].newText
    end
  end
  return texts
end

--- `2 files to create, 1 to remove`
local function counts(generated, words)
  local count = {}
  for _, file in ipairs(generated.files) do
    count[file.action] = (count[file.action] or 0) + 1
  end
  local said = {}
  for _, action in ipairs({ 'create', 'change', 'remove' }) do
    if count[action] then
      table.insert(said, ('%d %s'):format(count[action], words[action]))
    end
  end
  return table.concat(said, ', ')
end

local TO_DO = { create = 'to create', change = 'to change', remove = 'to remove' }
local DONE = { create = 'created', change = 'changed', remove = 'removed' }

--- All that would be done, with the differences of what is there already.
---@param generated mauve.Generated
---@return string[]
function M.preview(generated)
  local texts = texts_of(generated)
  local lines = { ('Orocos packages in %s: %s'):format(generated.folder, counts(generated, TO_DO)), '' }
  for _, file in ipairs(generated.files) do
    table.insert(lines, ('%s  %s'):format(file.action, file.path))
  end
  if type(generated.warning) == 'string' then
    vim.list_extend(lines, { '', generated.warning })
  end
  for _, file in ipairs(generated.files) do
    local path = vim.fs.joinpath(generated.folder, file.path)
    if file.action == 'change' then
      vim.list_extend(lines, { '', '--- ' .. file.path, '+++ ' .. file.path })
      local diff = vim.text and vim.text.diff or vim.diff
      local difference = diff(vim.fn.readblob(path), texts[real(path)], { ctxlen = 2 })
      vim.list_extend(lines, vim.split(vim.trim(difference), '\n'))
    end
  end
  -- A line of a buffer is one line, whatever a name has in it.
  return vim.tbl_map(function(line)
    return (line:gsub('[%z\r\n]', '?'))
  end, lines)
end

--- A file that is to be written, and that has changes in a buffer which would be lost.
---@param generated mauve.Generated
---@return string?
local function unsaved(generated)
  local modified = {}
  for _, buffer in ipairs(vim.api.nvim_list_bufs()) do
    local name = vim.api.nvim_buf_get_name(buffer)
    if vim.bo[buffer].modified and name ~= '' and vim.bo[buffer].buftype == '' then
      modified[real(name)] = name
    end
  end
  for _, file in ipairs(generated.files) do
    local name = modified[real(vim.fs.joinpath(generated.folder, file.path))]
    if name then
      return name
    end
  end
end

--- Shows lines in a window of their own.
---@param lines string[]
---@return fun() close
local function show(lines)
  local before = vim.api.nvim_get_current_win()
  local drawings = require('mauve.drawings')
  local buffer = drawings.new('generate', 'split', #lines, '<Nop>')
  drawings.write(buffer, lines)
  vim.bo[buffer].filetype = 'diff'
  vim.cmd.redraw()
  return function()
    pcall(vim.api.nvim_buf_delete, buffer, { force = true })
    if vim.api.nvim_win_is_valid(before) then
      vim.api.nvim_set_current_win(before)
    end
  end
end

local function tell(message, level)
  vim.notify('mauve: ' .. message, level)
end

--- Says which file has changes that would be lost, if there is one.
local function is_unsaved(generated)
  local name = unsaved(generated)
  if name then
    tell(('%s has unsaved changes: save or discard them'):format(name), vim.log.levels.ERROR)
  end
  return name ~= nil
end

--- Shows what would be done, asks, and does it.
---@param client vim.lsp.Client
---@param uri string  a file of the projects that are meant
---@param deployment? string  without one: all packages
function M.generate(client, uri, deployment)
  local params = { textDocument = { uri = uri }, deployment = deployment }
  ---@param generated mauve.Generated
  local function ask(generated)
    if is_unsaved(generated) then
      return
    end
    if type(generated.nothing) == 'string' then
      local warning = type(generated.warning) == 'string' and generated.warning
      local level = warning and vim.log.levels.WARN or vim.log.levels.INFO
      tell(generated.nothing .. (warning and '\n' .. warning or ''), level)
      return
    end
    local close = show(M.preview(generated))
    vim.ui.select({ 'Generate', 'Cancel' }, {
      prompt = ('%s in %s?'):format(counts(generated, TO_DO), generated.folder),
      kind = 'mauve.generate',
    }, function(choice)
      close()
      if choice ~= 'Generate' then
        return
      end
      -- Some that choose leave the user at work meanwhile.
      if is_unsaved(generated) then
        return
      end
      -- What was shown is written, and nothing else.
      local writing = vim.tbl_extend('error', params, { write = generated.edit })
      mauve.request(client, 'mauve/generate', writing, function(now)
        if not vim.deep_equal(now, generated) then
          tell('the files have changed in the meantime: this is the new preview', vim.log.levels.WARN)
          ask(now)
          return
        end
        vim.cmd('silent! checktime')
        tell(('%s in %s'):format(counts(now, DONE), now.folder), vim.log.levels.INFO)
      end)
    end)
  end
  mauve.request(client, 'mauve/generate', params, ask)
end

--- `:Mauve generate`
---@param deployment? string
function M.run(deployment)
  local buffer = vim.api.nvim_get_current_buf()
  local client = mauve.client(buffer)
  if client then
    M.generate(client, vim.uri_from_bufnr(buffer), deployment)
  end
end

--- What a code action or a lens executes.
---@param command lsp.Command
---@param context lsp.HandlerContext
function M.execute(command, context)
  local uri, deployment = unpack(command.arguments or {})
  local client = vim.lsp.get_client_by_id(context.client_id)
  if client and type(uri) == 'string' then
    M.generate(client, uri, type(deployment) == 'string' and deployment or nil)
  end
end

--- The deployments of the current buffer, to complete their names.
---@return string[]
function M.deployments()
  local found = {}
  for _, line in ipairs(vim.api.nvim_buf_get_lines(0, 0, -1, false)) do
    table.insert(found, line:match('^%s*deployment%s+([%w_]+)'))
  end
  return found
end

return M
