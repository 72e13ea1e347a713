-- Orocos packages: what would be done is shown, and done when the user says so. The server only plans: it writes nothing.

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
---@field changedCodels { path: string, before: string, now: string }[]
---@field leftCodels string[]
---@field leftFiles string[]
---@field leftPackages string[]
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

local function read(path)
  local file = io.open(path, 'rb')
  local text = file and file:read('*a')
  if file then
    file:close()
  end
  return text or ''
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

--- What stays, though the models have left it behind: the codels of which the user's files are of another prototype, as
--- differences; files of no codel, files that may be the user's, and packages.
---@param generated mauve.Generated
---@return string[]
local function left(generated)
  local lines = {}
  for _, codel in ipairs(generated.changedCodels) do
    table.insert(lines, ('--- %s: your file, kept unchanged'):format(codel.path))
    table.insert(lines, ('+++ %s.new'):format(codel.path))
    for _, prototype in ipairs({ { '-', codel.before }, { '+', codel.now } }) do
      local sign, text = unpack(prototype)
      for line in vim.gsplit(text, '\n', { trimempty = true }) do
        table.insert(lines, sign .. line)
      end
    end
  end
  for _, path in ipairs(generated.leftCodels) do
    table.insert(lines, ('%s: the model no longer has this codel; your file is kept'):format(path))
  end
  for _, path in ipairs(generated.leftFiles) do
    table.insert(lines, ('%s: no longer generated; kept because you may have written it'):format(path))
  end
  for _, name in ipairs(generated.leftPackages) do
    table.insert(lines, ('%s: this package is no longer generated from these models; remove it if you do not need it'):format(name))
  end
  return lines
end

--- All that would be done, with the differences of what is there already.
---@param generated mauve.Generated
---@return string[]
function M.preview(generated)
  local texts = texts_of(generated)
  local lines = { ('Orocos packages in %s: %s'):format(generated.folder, counts(generated, TO_DO)), '' }
  for _, file in ipairs(generated.files) do
    table.insert(lines, ('%s  %s'):format(file.action, file.path))
  end
  local kept = left(generated)
  if #kept > 0 then
    vim.list_extend(lines, { '', 'No longer in the models:', '' })
    vim.list_extend(lines, kept)
  end
  for _, file in ipairs(generated.files) do
    local path = vim.fs.joinpath(generated.folder, file.path)
    if file.action == 'change' then
      vim.list_extend(lines, { '', '--- ' .. file.path, '+++ ' .. file.path })
      local diff = vim.text and vim.text.diff or vim.diff
      local difference = diff(read(path), texts[real(path)], { ctxlen = 2 })
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

--- Makes the folder of a file, and those above; `made` gets them, the outermost first.
local function make_folder(path, made)
  local folder = vim.fs.dirname(path)
  if vim.uv.fs_stat(folder) then
    return true
  end
  local there, why = make_folder(folder, made)
  if there then
    there, why = vim.uv.fs_mkdir(folder, 511)
  end
  if there then
    table.insert(made, folder)
  end
  return there, why
end

--- Writes a file that must not be there yet.
local function write_new(path, text, mode)
  local file, why = vim.uv.fs_open(path, 'wx', mode)
  if not file then
    return nil, why
  end
  local written, failed = vim.uv.fs_write(file, text)
  local closed, lost = vim.uv.fs_close(file)
  if written ~= #text or not closed then
    vim.uv.fs_unlink(path)
    return nil, failed or lost or ('no space for ' .. path)
  end
  return true
end

--- Writes files: all of them, or none where one cannot be written.
---@param generated mauve.Generated
---@return string? problem
local function write(generated)
  local texts = texts_of(generated)
  local undo, aside = {}, {}
  local function undone_by(what, ...)
    table.insert(undo, { what, ... })
  end
  local function give_up(problem)
    for index = #undo, 1, -1 do
      local what, path, to = unpack(undo[index])
      local back, why = what(path, to)
      if not back and what == vim.uv.fs_rename then
        problem = ('%s; the file %s is now %s (%s)'):format(problem, to, path, why)
      end
    end
    return problem
  end

  -- All texts are on the disk before the first of them takes its place.
  for _, file in ipairs(generated.files) do
    local path = vim.fs.joinpath(generated.folder, file.path)
    if file.action ~= 'remove' then
      local made = {}
      local there, why = make_folder(path, made)
      for _, folder in ipairs(made) do
        undone_by(vim.uv.fs_rmdir, folder)
      end
      if not there then
        return give_up(why)
      end
      local known = vim.uv.fs_stat(path)
      -- One that is there already is somebody else's.
      local new = path .. '.mauve-new'
      local written, failed = write_new(new, texts[real(path)], known and known.mode or 438)
      if not written then
        return give_up(failed)
      end
      undone_by(vim.uv.fs_unlink, new)
    end
  end

  local function put(file)
    local path = vim.fs.joinpath(generated.folder, file.path)
    local new, old = path .. '.mauve-new', path .. '.mauve-old'
    if file.action == 'create' then
      -- Unlike a new name, a link takes nobody's place.
      local linked, why, code = vim.uv.fs_link(new, path)
      if not linked and code ~= 'EEXIST' and not vim.uv.fs_lstat(path) then
        linked, why = vim.uv.fs_rename(new, path) -- Not all file systems have links.
      end
      if not linked then
        return why
      end
      undone_by(vim.uv.fs_unlink, path)
      vim.uv.fs_unlink(new)
      return
    end
    if vim.uv.fs_lstat(old) then
      return 'EEXIST: file already exists: ' .. old
    end
    -- By a link it is never missing.
    local linked = file.action == 'change' and vim.uv.fs_link(path, old)
    if not linked then
      local kept, why = vim.uv.fs_rename(path, old)
      if not kept then
        return why
      end
      undone_by(vim.uv.fs_rename, old, path)
    end
    if file.action == 'change' then
      local moved, why = vim.uv.fs_rename(new, path)
      if linked and not moved then
        vim.uv.fs_unlink(old)
      elseif linked then
        undone_by(vim.uv.fs_rename, old, path)
      end
      if not moved then
        return why
      end
    end
    table.insert(aside, old)
  end
  -- A manifest says what was written, and comes behind it.
  for _, are_manifests in ipairs({ false, true }) do
    for _, file in ipairs(generated.files) do
      if vim.endswith(file.path, '.mauve-manifest.json') == are_manifests then
        local problem = put(file)
        if problem then
          return give_up(problem)
        end
      end
    end
  end
  for _, old in ipairs(aside) do
    vim.uv.fs_unlink(old)
  end
end

--- Shows lines in a window of their own.
---@param lines string[]
---@return fun() close
local function show(lines)
  local before = vim.api.nvim_get_current_win()
  vim.cmd('botright new')
  local window, buffer = vim.api.nvim_get_current_win(), vim.api.nvim_get_current_buf()
  vim.api.nvim_buf_set_lines(buffer, 0, -1, false, lines)
  vim.bo[buffer].buftype = 'nofile'
  vim.bo[buffer].bufhidden = 'wipe'
  vim.bo[buffer].swapfile = false
  vim.bo[buffer].modifiable = false
  vim.bo[buffer].filetype = 'diff'
  vim.cmd.redraw()
  return function()
    if vim.api.nvim_win_is_valid(window) then
      pcall(vim.api.nvim_win_close, window, true)
    end
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
    if #generated.files == 0 then
      local kept = left(generated)
      tell(
        ('the Orocos packages in %s are up to date'):format(generated.folder)
          .. (#kept > 0 and ('; but:\n' .. table.concat(kept, '\n')) or ''),
        #kept > 0 and vim.log.levels.WARN or vim.log.levels.INFO
      )
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
      mauve.request(client, 'mauve/generate', params, function(now)
        if not vim.deep_equal(now, generated) then
          tell('the files have changed in the meantime: this is the new preview', vim.log.levels.WARN)
          ask(now)
          return
        end
        -- Some that choose leave the user at work meanwhile.
        if is_unsaved(now) then
          return
        end
        local problem = write(now)
        if problem then
          tell(('nothing was written: %s'):format(problem), vim.log.levels.ERROR)
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
