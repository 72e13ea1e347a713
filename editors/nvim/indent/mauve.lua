if vim.b.did_indent then
  return
end
vim.b.did_indent = true

local opening = { ['}'] = '{', [')'] = '(' }

-- The innermost bracket that is open where a line begins, or whether that is within a comment. The text is read from its
-- beginning: that is exact, and much faster than asking the syntax file at each bracket on the way back.
local function before(last)
  local open, in_comment = {}, false
  for number, line in ipairs(vim.api.nvim_buf_get_lines(0, 0, last - 1, false)) do
    local column = 0
    while true do
      column = line:find(in_comment and '%*/' or '["/{}()]', column + 1)
      local character = column and line:sub(column, column)
      if not character then
        break
      elseif in_comment then
        in_comment = false
        column = column + 1
      elseif character == '"' then
        repeat
          column = line:find('["\\]', column + 1)
          local escape = column and line:sub(column, column) == '\\'
          column = escape and column + 1 or column
        until not escape
        if not column then
          break
        end
      elseif line:find('^//', column) then
        break
      elseif line:find('^/%*', column) then
        in_comment = true
        column = column + 1
      elseif character == '{' or character == '(' then
        table.insert(open, { line = number, column = column, character = character })
      elseif #open > 0 and open[#open].character == opening[character] then
        table.remove(open)
      end
    end
  end
  return open[#open], in_comment
end

-- Two columns more than the line of the brace that is open here, or just behind the parenthesis that is.
function _G.MauveIndent()
  local bracket, in_comment = before(vim.v.lnum)
  if in_comment then
    return -1 -- As it is.
  elseif not bracket then
    return 0
  elseif bracket.character == '(' then
    return vim.fn.virtcol({ bracket.line, bracket.column })
  end
  local closes = vim.fn.getline(vim.v.lnum):find('^%s*}')
  return vim.fn.indent(bracket.line) + (closes and 0 or vim.fn.shiftwidth())
end

vim.bo.indentexpr = 'v:lua.MauveIndent()'
vim.bo.indentkeys = '0{,0},0),!^F,o,O'
vim.bo.autoindent = true

vim.b.undo_indent = 'setlocal indentexpr< indentkeys< autoindent<'
