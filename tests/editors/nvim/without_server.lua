-- What the plugin does by itself. Run by ./run, with a server that is not there.

local checking = dofile(vim.fs.joinpath(vim.fs.dirname(debug.getinfo(1, 'S').source:sub(2)), 'checking.lua'))
local check, equal, wait = checking.check, checking.equal, checking.wait

local notified = {}
vim.notify = function(message)
  table.insert(notified, message)
end

local function write(name, text)
  local path = vim.fs.joinpath(vim.fs.dirname(checking.folder), name)
  vim.fn.writefile(vim.split(text, '\n'), path)
  return path
end

check('.mal is MAUVE by its content', function()
  local texts = {
    { true, '' },
    { true, '// A comment\n\nlibrary a {\n}' },
    { true, '/* #id: "x"\n category Y {\n*/ \ninclude "a.mal"\n  codel f(): int' },
    { true, '\239\187\191deployment D {' },
    { true, 'activity half { typed' },
    { true, 'library\r\n{\r\n}' },
    { true, 'include "a.mal"\n' },
    { true, 'category' },
    { false, '\239\187\191#id : "x"' },
    { false, '#id: "org.example.lang"\n#version: "1.0.0"' },
    { false, '// Licence\ninclude "core.mal"\ncategory System {\n  asset Host {' },
    { false, 'associations {\n  Host [host] 1 <-- Runs --> * [apps] Application' },
    { false, 'category A\n{\n  abstract asset use {' },
    { false, ';; A Lisp\n(def! x 1)' },
  }
  for index, text in ipairs(texts) do
    vim.cmd.edit(write('text' .. index .. '.mal', text[2]))
    equal(text[1], vim.bo.filetype == 'mauve', text[2])
  end
  vim.cmd.edit('new.mal')
  equal('mauve', vim.bo.filetype)
  equal('mauve', vim.filetype.match({ filename = 'x.mal' }))
end)

check('a server that is not there is said once', function()
  wait('a message', function()
    return #notified
  end, function(count)
    return count > 0
  end)
  vim.wait(200)
  equal(1, #notified, table.concat(notified, '\n'))
  equal(true, notified[1]:find('cannot run "' .. vim.env.MAUVE_TEST_SERVER .. '": install it, or set', 1, true) ~= nil)
  vim.cmd('silent checkhealth mauve')
  local report = table.concat(vim.api.nvim_buf_get_lines(0, 0, -1, false), '\n')
  equal(true, report:find('ERROR "' .. vim.env.MAUVE_TEST_SERVER .. '" is not found', 1, true) ~= nil, report)
end)

check('a program in a relative folder is none', function()
  local mauve = require('mauve')
  local path, settings, here = vim.env.PATH, vim.g.mauve, vim.fn.getcwd()
  local program = write('somebodys', '#!/bin/sh')
  local folder = vim.fs.dirname(program)
  vim.fn.setfperm(program, 'rwx------')
  vim.cmd.cd(folder)
  for _, set in ipairs({ 'somebodys', './somebodys' }) do
    vim.g.mauve = { server = { path = set } }
    vim.env.PATH = '.::' .. path
    equal(0, vim.fn.executable(mauve.command()[1]), set)
  end
  vim.g.mauve = { server = { path = 'somebodys', arguments = { 'lsp', '--log', 'x' } } }
  vim.env.PATH = '.:' .. folder
  equal({ program, 'lsp', '--log', 'x' }, mauve.command())
  vim.env.PATH, vim.g.mauve = path, settings
  vim.cmd.cd(here)
end)

local function check_indent(path)
  vim.cmd.edit(path)
  local text = vim.api.nvim_buf_get_lines(0, 0, -1, false)
  vim.cmd('silent normal! gg=G')
  equal(text, vim.api.nvim_buf_get_lines(0, 0, -1, false), path)
end

check('the sample robot is indented as it would be', function()
  for _, path in ipairs(vim.fn.glob(checking.folder .. '/**/*.mal', true, true)) do
    check_indent(path)
  end
end)

check('brackets in comments and strings indent nothing', function()
  check_indent(write('indent.mal', [[
library a { // {
  property x: string = "\\" /* { " */
  property x: string = "\" {"
  property x: string = "\
  property x: string = "{
  /*/ {
        odd */ property y: int
  codel f(a: int,
          b: int): bool
  )
  a / b
}
}
x]]))
end)

check('a keyword that is a name has the colour of a name', function()
  vim.cmd.edit(write('names.mal', [[
shell start {
  input port state: int
}
core C(start) {
  statemachine {
    initial state entry {
      run = { state = read(state); }
      transition to if (state) to to
    }
  }
}]]))
  local function group(line, word, nth)
    local text, column = vim.fn.getline(line), 0
    for _ = 1, nth or 1 do
      column = text:find('%f[%w_]' .. word .. '%f[^%w_]', column + 1)
    end
    return vim.fn.synIDattr(vim.fn.synID(line, column, 0), 'name')
  end
  equal('mauveStructure', group(1, 'shell'))
  equal('mauveTypeName', group(1, 'start'))
  equal('mauvePort', group(2, 'port'))
  equal('mauveName', group(2, 'state'))
  equal('mauveBuiltinType', group(2, 'int'))
  equal('mauveState', group(6, 'state'))
  equal('mauveLabel', group(6, 'entry'))
  equal('mauveKeyword', group(7, 'run'))
  equal('', group(7, 'state'))
  equal('mauveBuiltin', group(7, 'read'))
  equal('mauveLabel', group(8, 'to', 1))
  equal('mauveTo', group(8, 'to', 2))
  equal('mauveLabel', group(8, 'to', 3))
end)

check('gf opens an included file', function()
  vim.cmd.edit(vim.fs.joinpath(checking.folder, 'exploration.mal'))
  vim.fn.search('components/hokuyo')
  vim.cmd('normal! gf')
  equal('hokuyo.mal', vim.fs.basename(vim.api.nvim_buf_get_name(0)))
end)

check('the filetype leaves nothing behind', function()
  vim.bo.filetype = 'text'
  equal('', vim.bo.indentexpr)
  equal('', vim.bo.include)
end)

checking.done()
