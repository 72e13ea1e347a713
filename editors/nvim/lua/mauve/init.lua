-- What the parts of the plugin share. Nothing happens when this is loaded.

local M = {}

--- The file types of models, of tables and `mauve.toml`, and of what an executor of ROS 2 reads.
M.filetypes = { 'mauve', 'toml', 'yaml' }

---@class mauve.Settings  What `vim.g.mauve` may hold.
---@field server? { path?: string, arguments?: string[] }
---@field inlay_hints? boolean
---@field code_lens? boolean

---@return mauve.Settings
function M.settings()
  return vim.g.mauve or {}
end

local function is_absolute(path)
  if vim.fn.has('win32') == 1 then
    return path:find('^%a:[/\\]') ~= nil or path:find('^[/\\][/\\]') ~= nil
  end
  return vim.startswith(path, '/')
end

--- A program by its whole path: itself, or in the first absolute folder of PATH that has it. The server is started in the
--- folder of the project, where a stranger may have put anything: what is relative, such as `.`, would be in there.
---@param path string
---@return string
local function program_of(path)
  local is_name = not path:find('[/\\]')
  path = vim.fs.normalize(path)
  if is_absolute(path) then
    return path
  end
  local separator = vim.fn.has('win32') == 1 and ';' or ':'
  for _, folder in ipairs(is_name and vim.split(vim.env.PATH or '', separator, { plain = true }) or {}) do
    local program = is_absolute(folder) and vim.fn.exepath(vim.fs.joinpath(folder, path)) or ''
    if program ~= '' then
      return program
    end
  end
  -- A name would be looked for once more by whoever starts it, from the project's folder. No file is called so.
  return '/not found: ' .. path
end

--- The command that starts the server, as the settings have it.
---@return string[]
function M.command()
  local server = M.settings().server or {}
  return vim.list_extend({ program_of(server.path or 'mauve') }, server.arguments or { 'lsp' })
end

--- The server's configuration: that of `lsp/mauve.lua`, with what the user changed by `vim.lsp.config`.
---@return table
function M.config()
  if vim.lsp.config then
    return vim.lsp.config.mauve
  end
  return dofile(vim.api.nvim_get_runtime_file('lsp/mauve.lua', false)[1])
end

--- The program that the server's configuration starts, and whether there is one.
--- A configuration may have a function as its command. That one is taken to know what it does.
---@return string program
---@return boolean found
function M.program()
  local command = M.config().cmd
  if type(command) ~= 'table' then
    return tostring(command), true
  end
  return command[1], vim.fn.executable(command[1]) == 1
end

--- Starts the server for a buffer with one of its filetypes, as `vim.lsp.enable` does since 0.11, or says why not.
---@param buffer integer
function M.attach(buffer)
  if vim.bo[buffer].buftype ~= '' then
    return
  end
  local program, found = M.program()
  if not found then
    if vim.bo[buffer].filetype == 'mauve' then
      local message = 'mauve: cannot run "%s": install it, or set vim.g.mauve.server.path (:help mauve-server)'
      -- Later: within an autocommand it would be an error of the autocommand.
      vim.schedule_wrap(vim.notify_once)(message:format(program), vim.log.levels.ERROR)
    end
  elseif not vim.lsp.enable then
    local config = M.config()
    config.root_dir(buffer, function(root)
      config.root_dir = root
      vim.lsp.start(config, { bufnr = buffer })
    end)
  end
end

--- Starts the server for all buffers that are there, and those to come.
function M.start()
  if vim.lsp.enable then
    vim.lsp.enable('mauve')
    return
  end
  for _, buffer in ipairs(vim.api.nvim_list_bufs()) do
    if vim.api.nvim_buf_is_loaded(buffer) and vim.list_contains(M.config().filetypes, vim.bo[buffer].filetype) then
      M.attach(buffer)
    end
  end
end

--- Shows code lenses in a buffer, and new ones when they may say something else.
---@param buffer integer
---@param group integer
function M.show_lenses(buffer, group)
  if vim.lsp.codelens.enable then
    vim.lsp.codelens.enable(true, { bufnr = buffer })
    return
  end
  vim.api.nvim_create_autocmd({ 'BufEnter', 'InsertLeave', 'TextChanged' }, {
    group = group,
    buffer = buffer,
    callback = function()
      vim.lsp.codelens.refresh({ bufnr = buffer })
    end,
  })
  vim.lsp.codelens.refresh({ bufnr = buffer })
end

--- The client of a buffer, or else any; without one, the user is told.
---@param buffer? integer
---@return vim.lsp.Client?
function M.client(buffer)
  local clients = buffer and vim.lsp.get_clients({ name = 'mauve', bufnr = buffer }) or {}
  local client = clients[1] or vim.lsp.get_clients({ name = 'mauve' })[1]
  if not client then
    vim.notify('mauve: no server is running', vim.log.levels.ERROR)
  end
  return client
end

--- Calls a function of a client: these are methods since 0.11.
---@param client vim.lsp.Client
---@param name 'notify'|'request'|'stop'
function M.call(client, name, ...)
  if vim.fn.has('nvim-0.11') == 1 then
    return client[name](client, ...)
  end
  return client[name](...)
end

--- Goes to a place in the current window.
---@param place lsp.Location
function M.go_to(place)
  local client = vim.lsp.get_clients({ name = 'mauve' })[1]
  local encoding = client and client.offset_encoding or 'utf-16'
  if vim.lsp.util.show_document then
    vim.lsp.util.show_document(place, encoding, { focus = true })
  else
    vim.lsp.util.jump_to_location(place, encoding, true)
  end
end

--- An edit has overtaken a request: the answer would be about another text.
local CONTENT_MODIFIED = -32801

--- Sends a request to the server, again if an edit has made it outdated.
---@param client vim.lsp.Client
---@param method string
---@param params any
---@param take? fun(result: any)
---@param refuse? fun(message: string)  handles an error; by default, the user is told
function M.request(client, method, params, take, refuse)
  local attempts = 0
  local function ask()
    attempts = attempts + 1
    local function answered(err, result)
      if err and err.code == CONTENT_MODIFIED and attempts < 10 then
        vim.defer_fn(ask, 100)
      elseif err and refuse then
        refuse(err.message)
      elseif err then
        vim.notify('mauve: ' .. err.message, vim.log.levels.ERROR)
      elseif take then
        take(result)
      end
    end
    M.call(client, 'request', method, params, answered)
  end
  ask()
end

--- Shows everything at another significance level, for the rest of the session; without one, asks for it.
---@param level? string
function M.choose_significance(level)
  local client = M.client()
  if not client then
    return
  end
  local function choose(chosen)
    M.request(client, 'workspace/executeCommand', { command = 'mauve.setSignificance', arguments = { chosen } })
  end
  if level then
    choose(level == 'mauve.toml' and vim.NIL or level)
    return
  end
  M.request(client, 'mauve/status', nil, function(status)
    local levels = vim.list_extend(status.levels, { vim.NIL })
    vim.ui.select(levels, {
      prompt = 'Significance level',
      format_item = function(item)
        return item == vim.NIL and 'the level of mauve.toml' or ('%g'):format(item)
      end,
    }, function(chosen)
      if chosen then
        choose(chosen)
      end
    end)
  end)
end

local verdict, is_due = { text = '', status = 'time' }, false

--- Returns the verdict on the deadlines of all deployments, in closed files too: `✗ 1 late · 2 unknown · 9 measured`.
function M.verdict()
  return verdict.text
end

--- Returns the verdict as a part of a status line, in the colour of its worst part; a click lists the problems:
--- `vim.o.statusline = "%f %= %{%v:lua.require'mauve'.statusline()%}"`.
function M.statusline()
  local text = verdict.text:gsub('%%', '%%%%')
  local group = require('mauve.figures').group(verdict.status)
  return text == '' and '' or ("%%@v:lua.require'mauve'.clicked@%%#%s#MAUVE %s%%*%%X"):format(group, text)
end

--- A click on the verdict.
function M.clicked()
  require('mauve.problems').show()
end

--- Asks for the verdict, again later while the server works. The plugin calls it when diagnostics change.
function M.update_verdict()
  if is_due then
    return
  end
  is_due = true
  vim.defer_fn(function()
    is_due = false
    local client = vim.lsp.get_clients({ name = 'mauve' })[1]
    if not client then
      verdict = { text = '', status = 'time' }
      return
    end
    M.call(client, 'request', 'mauve/status', nil, function(_, status)
      if type(status) ~= 'table' then
        return
      elseif type(status.verdict) ~= 'table' then
        M.update_verdict()
      elseif not vim.deep_equal(status.verdict, verdict) then
        verdict = status.verdict
        vim.cmd.redrawstatus({ bang = true })
      end
      if package.loaded['mauve.problems'] then
        require('mauve.problems').update()
      end
    end)
  end, 300)
end

--- Asks each server to compare its files with the disk: files may have changed without an event while the user was elsewhere.
function M.focused()
  for _, client in ipairs(vim.lsp.get_clients({ name = 'mauve' })) do
    M.call(client, 'notify', 'mauve/focus', vim.empty_dict())
  end
end

--- Has the server read and analyse all files again.
function M.reload()
  local client = M.client()
  if client then
    M.request(client, 'workspace/executeCommand', { command = 'mauve.reload' })
  end
end

--- Stops the server and starts it again, after it was built anew, say.
function M.restart()
  local clients = vim.lsp.get_clients({ name = 'mauve' })
  local function stop(force)
    for _, client in ipairs(clients) do
      M.call(client, 'stop', force)
    end
    return vim.wait(1000, function()
      return #vim.lsp.get_clients({ name = 'mauve' }) == 0
    end)
  end
  if stop(false) or stop(true) then
    M.start()
  else
    vim.notify('mauve: the server does not stop', vim.log.levels.ERROR)
  end
end

return M
