-- Neovim as a client of `hyd lsp`, set up as the guide says: messages while typing, what stands under the cursor, renaming, layout.
--
-- nvim --headless -u NONE -c 'luafile tests/outside/editor.lua', with the command `hyd` on the path and WORK, an empty folder, in the environment.
local work = os.getenv("WORK")

-- The first block of Lua in the guide.
local function guide()
  local file = assert(io.open("docs/guides/editor.md"))
  local block = file:read("a"):match("```lua\n(.-)```")
  file:close()
  return assert(loadstring(block))
end

local function write(path, text)
  vim.fn.mkdir(vim.fn.fnamemodify(path, ":h"), "p")
  local file = assert(io.open(path, "w"))
  file:write(text)
  file:close()
end

local function check()
  write(work .. "/Lib/package.hyd", "package Lib\n  model Part\n    parameter Real R(unit = \"Ohm\") = 1 \"resistance\";\n  end Part;\nend Lib;\n")
  write(work .. "/m.hyd", "model M\n  Lib.Part part(R = 2);\n  Real x = 2*part.R;\nend M;\n")
  guide()()
  vim.cmd("cd " .. work)
  vim.cmd("edit m.hyd")
  local client = assert(hyd_client, "the guide starts the server")
  assert(vim.wait(20000, function() return vim.lsp.get_client_by_id(client).initialized end, 20), "no server")

  -- Messages come and go with what is typed.
  vim.api.nvim_buf_set_lines(0, 2, 3, true, { "  Real x = 2*part.Rs;" })
  assert(vim.wait(20000, function() return #vim.diagnostic.get(0) == 1 end, 20), "no message")
  local said = vim.diagnostic.get(0)[1]
  assert(said.lnum == 2 and said.col == 18 and said.message:find("has no element `Rs`", 1, true), vim.inspect(said))
  vim.api.nvim_buf_set_lines(0, 2, 3, true, { "  Real x = 2*part.R;" })
  assert(vim.wait(20000, function() return #vim.diagnostic.get(0) == 0 end, 20), "the message stays")

  vim.api.nvim_win_set_cursor(0, { 3, 18 })
  local answer = vim.lsp.buf_request_sync(0, "textDocument/hover", vim.lsp.util.make_position_params(), 20000)
  local text = answer[client].result.contents.value
  assert(text:find("parameter Real R", 1, true) and text:find("`Ohm`", 1, true) and text:find("`2`", 1, true), text)

  -- Neovim makes the changes itself, in this file and in the library's.
  vim.lsp.buf.rename("Ra")
  assert(vim.wait(20000, function() return vim.api.nvim_buf_get_lines(0, 2, 3, true)[1] == "  Real x = 2*part.Ra;" end, 20), "not renamed")
  assert(vim.api.nvim_buf_get_lines(0, 1, 2, true)[1] == "  Lib.Part part(Ra = 2);")
  local library = vim.fn.bufnr(work .. "/Lib/package.hyd")
  assert(vim.api.nvim_buf_get_lines(library, 2, 3, true)[1]:find("Real Ra(", 1, true))

  vim.api.nvim_buf_set_lines(0, 2, 3, true, { "Real x=2*part.Ra;" })
  vim.lsp.buf.formatting_sync({}, 20000)
  assert(vim.api.nvim_buf_get_lines(0, 2, 3, true)[1] == "  Real x = 2*part.Ra;", vim.api.nvim_buf_get_lines(0, 2, 3, true)[1])
end

local fine, fault = xpcall(check, debug.traceback)
if fine then
  io.stdout:write("Neovim: messages, hover, renaming and layout come from hyd lsp\n")
  vim.cmd("qall!")
else
  io.stderr:write(fault .. "\n")
  vim.cmd("cquit 1")
end
