-- :checkhealth mauve

local mauve = require('mauve')
local health = vim.health
local M = {}

local function check_server()
  health.start('mauve: server')
  local command = mauve.config().cmd
  local program, found = mauve.program()
  if type(command) ~= 'table' then
    health.info('The server is started by a function of your configuration')
    return
  end
  if not found then
    health.error(('"%s" is not found, or cannot be executed'):format(program), {
      'Install it: `cargo install --locked --path server` in the sources of MAUVE',
      "Or say where it is: `vim.g.mauve = { server = { path = '…' } }`, :help mauve-server",
    })
    return
  end
  health.ok(('Found: `%s`'):format(vim.fn.exepath(program)))
  health.info(('Started as: `%s`'):format(table.concat(command, ' ')))
  local ok, process = pcall(vim.system, { program, '--version' }, { text = true, timeout = 2000 })
  local result = ok and process:wait()
  if result and result.code == 0 then
    health.ok('Version: ' .. vim.trim(result.stdout))
  else
    health.error(('`%s --version` fails'):format(program), vim.trim(result and result.stderr or tostring(process)))
  end
end

local function check_clients()
  health.start('mauve: clients')
  local clients = vim.lsp.get_clients({ name = 'mauve' })
  if #clients == 0 then
    health.info('No server is running. One starts with the first `.mal` file')
  end
  for _, client in ipairs(clients) do
    local info = client.server_info or {}
    health.ok(('Client %d runs %s %s in `%s`'):format(
      client.id,
      info.name or client.name,
      info.version or '',
      client.config.root_dir or 'no project: a single file'
    ))
  end
  health.info(('Log: `%s`'):format(vim.lsp.log.get_filename()))
end

local function check_buffers()
  health.start('mauve: buffers')
  for _, buffer in ipairs(vim.api.nvim_list_bufs()) do
    local name = vim.api.nvim_buf_get_name(buffer)
    if vim.api.nvim_buf_is_loaded(buffer) and (vim.bo[buffer].filetype == 'mauve' or name:find('%.mal$')) then
      local attached = #vim.lsp.get_clients({ name = 'mauve', bufnr = buffer }) > 0
      local text = ('`%s`: filetype "%s", %s'):format(
        name == '' and '[No Name]' or vim.fn.fnamemodify(name, ':~:.'),
        vim.bo[buffer].filetype,
        attached and 'attached' or 'not attached'
      )
      if attached then
        health.ok(text)
      elseif vim.bo[buffer].filetype == 'mauve' then
        health.warn(text)
      else
        health.info(text .. ' (`.mal` is the Meta Attack Language too; `:set filetype=mauve` if this is MAUVE)')
      end
    end
  end
  if vim.filetype.match({ filename = 'x.mal' }) ~= 'mauve' then
    health.error('Files ending in `.mal` are not recognised', 'Is `:filetype on` in effect?')
  end
end

function M.check()
  health.start('mauve: Neovim')
  local version = vim.version()
  local text = ('Neovim %d.%d.%d'):format(version.major, version.minor, version.patch)
  if vim.fn.has('nvim-0.10') == 0 then
    health.error(text .. ' is too old', 'The language server needs Neovim 0.10 or later')
    return
  end
  health.ok(text .. (vim.lsp.enable and '' or ' (`vim.lsp.config` needs 0.11)'))
  check_server()
  check_clients()
  check_buffers()
end

return M
