-- `.mal` files that are not ours belong to the Meta Attack Language, or are programs in "Make a Lisp". The first line
-- that tells decides. A file where none does is ours: a new one, or one whose text is still to be mended.

local ours = {
  '^library%s', '^use%s', '^codel%s', '^shell%s', '^core%s', '^component%s', '^architecture%s', '^deployment%s',
}
local not_ours = {
  '^#%w+%s*:', '^category%s+%w', '^abstract%s+asset%s', '^asset%s+%w', '^associations%s*{',
  '^[(;]',
}

local function matches(line, patterns)
  return vim.iter(patterns):any(function(pattern)
    return (line .. ' '):find(pattern)
  end)
end

local function is_mauve(lines)
  local in_comment = false
  for _, line in ipairs(lines) do
    line = vim.trim(line)
    if in_comment then
      in_comment = not line:find('*/', 1, true)
    elseif line:find('^/%*') then
      in_comment = not line:find('*/', 3, true)
    elseif matches(line, ours) then
      return true
    elseif matches(line, not_ours) then
      return false
    end
  end
  return true
end

vim.filetype.add({
  extension = {
    mal = function(_, buffer)
      -- There may be none, when somebody asks for the type of a file name.
      if not vim.api.nvim_buf_is_valid(buffer) or is_mauve(vim.api.nvim_buf_get_lines(buffer, 0, 500, false)) then
        return 'mauve'
      end
    end,
  },
})
