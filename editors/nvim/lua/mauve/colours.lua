-- The colours of names, by what they mean: the types and modifiers of semantic tokens that are MAUVE's own.

local M = {}

-- What each looks like unless the user or a colour scheme says otherwise.
local types = {
  codel = '@lsp.type.function',
  shell = '@lsp.type.interface',
  core = '@lsp.type.class',
  component = '@lsp.type.class',
  architecture = '@lsp.type.struct',
  deployment = '@lsp.type.struct',
  instance = '@lsp.type.variable',
  port = '@lsp.type.property',
  operation = '@lsp.type.method',
  handler = '@lsp.type.variable',
  state = '@lsp.type.enumMember',
  transition = '@lsp.type.event',
}

-- Nothing by default: what is written is to be told from what is read by whoever wants that.
local modifiers = {
  input = false,
  output = false,
  required = false,
  provided = false,
}

--- Links the highlight groups of our types, for those that nobody has set.
function M.link()
  for name, group in pairs(types) do
    for _, filetype in ipairs({ 'mauve', 'toml' }) do
      vim.api.nvim_set_hl(0, ('@lsp.type.%s.%s'):format(name, filetype), { link = group, default = true })
    end
  end
end

--- Adds ours to what the client says that it knows: the server sends no others.
---@param capabilities lsp.ClientCapabilities
function M.extend(capabilities)
  local known = vim.tbl_get(capabilities, 'textDocument', 'semanticTokens')
  if not known then
    return
  end
  for field, ours in pairs({ tokenTypes = types, tokenModifiers = modifiers }) do
    known[field] = known[field] or {}
    for name in vim.spairs(ours) do
      if not vim.list_contains(known[field], name) then
        table.insert(known[field], name)
      end
    end
  end
end

return M
