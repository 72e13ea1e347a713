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

local function check_files()
  health.start('mauve: files')
  for _, buffer in ipairs(vim.api.nvim_list_bufs()) do
    local name = vim.api.nvim_buf_get_name(buffer)
    if vim.api.nvim_buf_is_loaded(buffer) and name:find('%.mal$') and vim.bo[buffer].filetype ~= 'mauve' then
      local text = '`%s`: filetype "%s" (`.mal` is the Meta Attack Language too; `:set filetype=mauve` if this is MAUVE)'
      health.info(text:format(vim.fn.fnamemodify(name, ':~:.'), vim.bo[buffer].filetype))
    end
  end
  if vim.filetype.match({ filename = 'x.mal' }) == 'mauve' then
    health.ok('Files ending in `.mal` are recognised')
  else
    health.error('Files ending in `.mal` are not recognised', 'Is `:filetype on` in effect?')
  end
  health.info('`:checkhealth vim.lsp` lists the servers that run, their folders and buffers, and the log')
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
  check_files()
end

return M
