-- What the parts of the plugin share. Nothing happens when this is loaded.

local M = {}

---@class mauve.Settings  What `vim.g.mauve` may hold.
---@field server? { path?: string, arguments?: string[] }
---@field inlay_hints? boolean

---@return mauve.Settings
function M.settings()
  return vim.g.mauve or {}
end

--- The command that starts the server, as the settings have it.
---@return string[]
function M.command()
  local server = M.settings().server or {}
  local path = server.path and vim.fs.normalize(server.path) or 'mauve'
  return vim.list_extend({ path }, server.arguments or { 'lsp' })
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

--- Stops the server and starts it again, after it was built anew, say.
function M.restart()
  local clients = vim.lsp.get_clients({ name = 'mauve' })
  local function stop(force)
    for _, client in ipairs(clients) do
      if vim.fn.has('nvim-0.11') == 1 then
        client:stop(force)
      else
        client.stop(force)
      end
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
