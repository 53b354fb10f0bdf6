-- The Lua part of the module `locus`: results of commands, scenes, batches by row, and expectations. Its argument is the
-- table of the functions in C++, the methods of servers, and functions for this file alone.
local locus, Server, internal = ...

-- Results of commands. `rows` is the list of rows; the fields of a single row are fields of the result, too.
local Result = {
  __index = function(result, key)
    local rows = rawget(result, "rows")
    if rows and #rows == 1 then return rows[1][key] end
  end
}

function locus.command(...)
  return setmetatable(internal.command(...), Result)
end

local default_server
-- Returns the connection of the program's options, or a new one to `address`.
function locus.connect(address)
  if address then return internal.open(address) end
  default_server = default_server or internal.open()
  return default_server
end

-- Returns the scene called `name` on the server of the program's options. Makes no call.
function locus.scene(name)
  return locus.connect():scene(name)
end

local Scene = {}
Scene.__index = Scene
function Server:scene(name)
  return setmetatable({ server = self, name = name }, Scene)
end

function Scene:create(spec) return self.server:create_scene{ name = self.name, spec = spec or {} } end
function Scene:delete(options)
  return self.server:delete_scene{ name = self.name, if_present = options and options.if_present }
end
function Scene:describe() return self.server:get_scene(self.name) end
function Scene:apply(batch) return self.server:apply(self.name, batch) end
function Scene:query(batch) return self.server:query(self.name, batch) end
function Scene:update_stream() return self.server:update_stream(self.name) end
function Scene:query_stream() return self.server:query_stream(self.name) end
function Scene:change_instances(change)
  change.scene = self.name
  return self.server:change_instances(change)
end

local function check_fields(what, row, known)
  if type(row) ~= "table" then locus.fail(what .. " takes a table, not " .. type(row)) end
  for name in pairs(row) do
    if not known[name] then
      local names = {}
      for other in pairs(known) do names[#names + 1] = other end
      locus.fail(what .. " has no field '" .. tostring(name) .. "'" .. internal.suggestion(tostring(name), names))
    end
  end
end

local function needed(what, row, name)
  if row[name] == nil then locus.fail(what .. " needs the field " .. name) end
  return row[name]
end

local function fields(names)
  local known = {}
  for name in names:gmatch("%S+") do known[name] = true end
  return known
end

-- Updates by row: one batch, which changes nothing before commit().
local Updates = {}
Updates.__index = Updates
function Scene:updates()
  return setmetatable({ scene = self, shapes = {}, batch = { inserts = {}, moves = {}, remove_ids = {},
    remove_groups = {}, relabels = {} } }, Updates)
end

local no_rotation <const> = { 0, 0, 0, 1 }
local insert_fields <const> = fields("id at rotation layers group tag point ball box capsule")
function Updates:insert(row)
  check_fields("insert", row, insert_fields)
  local shape = row.ball and "ball" or row.box and "box" or row.capsule and "capsule" or "point"
  local insert = self.shapes[shape]
  if not insert then
    insert = { ids = {}, positions_f64 = {}, rotations = {}, layers = {}, groups = {}, tags = {}, [shape] = {} }
    self.shapes[shape] = insert
    table.insert(self.batch.inserts, insert)
  end
  local n = #insert.ids + 1
  insert.ids[n] = needed("insert", row, "id")
  insert.positions_f64[n] = needed("insert", row, "at")
  insert.rotations[n] = row.rotation or no_rotation
  insert.layers[n] = row.layers or 1
  insert.groups[n] = row.group or 0
  insert.tags[n] = row.tag or 0
  local columns = insert[shape]
  if shape == "ball" then
    columns.radii = columns.radii or {}
    columns.radii[n] = row.ball
  elseif shape == "box" then
    columns.half_extents = columns.half_extents or {}
    columns.half_extents[n] = row.box
  elseif shape == "capsule" then
    columns.radii, columns.half_axes = columns.radii or {}, columns.half_axes or {}
    columns.radii[n] = needed("capsule", row.capsule, "radius")
    columns.half_axes[n] = needed("capsule", row.capsule, "axis")
  end
  return self
end

local move_fields <const> = fields("id at rotation teleport")
function Updates:move(row)
  check_fields("move", row, move_fields)
  local moves = self.batch.moves
  local move = moves[#moves]
  local turns = row.rotation ~= nil
  if not move or move.teleport ~= (row.teleport or false) or (move.rotations ~= nil) ~= turns then
    move = { ids = {}, positions_f64 = {}, rotations = turns and {} or nil, teleport = row.teleport or false }
    moves[#moves + 1] = move
  end
  local n = #move.ids + 1
  move.ids[n] = needed("move", row, "id")
  move.positions_f64[n] = needed("move", row, "at")
  if turns then move.rotations[n] = row.rotation end
  return self
end

local relabel_fields <const> = fields("id layers group tag")
function Updates:relabel(row)
  check_fields("relabel", row, relabel_fields)
  table.insert(self.batch.relabels, { ids = { needed("relabel", row, "id") }, layers = row.layers, groups = row.group,
    tags = row.tag })
  return self
end

function Updates:remove(id)
  table.insert(self.batch.remove_ids, id)
  return self
end

function Updates:remove_group(group)
  table.insert(self.batch.remove_groups, group)
  return self
end

-- Sends the batch with `options`, which are fields of the protocol's UpdateBatch, and returns the ack. The builder is
-- empty afterwards. The server applies removals, then inserts, then moves, then relabels.
function Updates:commit(options)
  local batch = self.batch
  for name, value in pairs(options or {}) do batch[name] = value end
  self.shapes = {}
  self.batch = { inserts = {}, moves = {}, remove_ids = {}, remove_groups = {}, relabels = {} }
  return self.scene:apply(batch)
end

-- Queries by row: one batch, answered at one revision. `options` are fields of the protocol's QueryBlock, such as
-- columns or frame.
local Queries = {}
Queries.__index = Queries
function Scene:queries(options)
  return setmetatable({ scene = self, options = options or {}, blocks = {}, places = {} }, Queries)
end

-- Sets entry `n` of a column that may be absent. It stays absent until a row has a value; then earlier rows get
-- `default`.
local function set_optional(columns, name, n, value, default)
  if columns[name] == nil then
    if value == nil then return end
    columns[name] = {}
    for i = 1, n - 1 do columns[name][i] = default end
  end
  if value == nil then value = default end
  columns[name][n] = value
end

-- Kinds of queries: the kind's field in a block, the columns of needed fields, and the columns and defaults of others.
local kinds <const> = {
  ray = { block = "rays", needs = { from = "origins", dir = "directions" }, takes = { t_max = { "t_max", math.huge } } },
  ball = { block = "balls", needs = { at = "centers", radius = "radii" }, takes = {} },
  box = { block = "boxes", needs = { at = "centers", half = "half_extents" },
    takes = { rotation = { "rotations", no_rotation } } },
  capsule = { block = "capsules", needs = { from = "starts", to = "ends", radius = "radii" }, takes = {} },
  sweep = { block = "sweeps", needs = { from = "starts", to = "ends", radius = "radii" }, takes = {} },
  nearest = { block = "nearest", needs = { at = "points" }, takes = { max_distance = { "max_distances", math.huge } } },
  contains = { block = "contains", needs = { at = "points" }, takes = {} },
}
-- Options that are fields of the protocol's QueryBlock; other options are fields of the kind's message.
local block_options <const> = fields("frame source precision columns max_results after_id as_of_ticks as_of_fractions "
  .. "outside_history anchor_ids count_only")
-- Fields of a row of any kind: the column of the block, and the default.
local row_options <const> = {
  mask = { "masks", 0xFFFFFFFF }, ignore_group = { "ignore_groups", 0 }, ignore_id = { "ignore_ids", 0 },
}

for kind, description in pairs(kinds) do
  local known = {}
  for _, names in ipairs{ description.needs, description.takes, row_options } do
    for name in pairs(names) do known[name] = true end
  end
  -- Adds a query. `options`, such as mode of rays, k of nearest or columns, hold for all queries of this kind in the
  -- batch.
  Queries[kind] = function(self, row, options)
    check_fields(kind, row, known)
    local entry = self.blocks[kind]
    if not entry then
      entry = { rows = 0, block = {}, columns = {} }
      entry.block[description.block] = entry.columns
      self.blocks[kind] = entry
      self.blocks[#self.blocks + 1] = entry
      entry.number = #self.blocks
    end
    local n = entry.rows + 1
    for name, column in pairs(description.needs) do
      entry.columns[column] = entry.columns[column] or {}
      entry.columns[column][n] = needed(kind, row, name)
    end
    for name, column in pairs(description.takes) do set_optional(entry.columns, column[1], n, row[name], column[2]) end
    for name, column in pairs(row_options) do set_optional(entry.block, column[1], n, row[name], column[2]) end
    for name, value in pairs(options or {}) do
      local target = block_options[name] and entry.block or entry.columns
      target[name] = value
    end
    entry.rows = n
    self.places[#self.places + 1] = { entry.number, n }
    return self
  end
end

-- Columns of an answer: the name of a row's field, the protocol's column, and how many values a row has.
local answer_columns <const> = {
  { "t", "t", 1 }, { "id", "ids", 1 }, { "triangle", "triangles", 1 }, { "group", "groups", 1 }, { "tag", "tags", 1 },
  { "layers", "layers", 1 }, { "other", "others", 1 }, { "uv", "uvs", 2 }, { "normal", "normals", 3 },
  { "point", "points", 3 }, { "position", "positions", 3 }, { "rotation", "rotations", 4 },
}

-- Returns row `n` of a block's answer.
local function row_of(answer, n)
  local row = {}
  for _, column in ipairs(answer_columns) do
    local name, values, width = column[1], answer[column[2]], column[3]
    if #values > 0 then
      row[name] = width == 1 and values[n] or table.move(values, (n - 1) * width + 1, n * width, 1, {})
    end
  end
  return row
end

-- Returns the answer to query `n` of a block: of rays and sweeps that ask for the first hit, the row or false; of those
-- that ask for any hit, a boolean; else the list of rows.
local function answer_of(answer, n)
  if #answer.hits > 0 then return answer.hits:byte(n) ~= 0 end
  if #answer.counts == 0 then
    local row = row_of(answer, n)
    return row.id ~= 0 and row
  end
  local rows = {}
  for i = answer.first_rows[n], answer.first_rows[n] + answer.counts[n] - 1 do rows[#rows + 1] = row_of(answer, i) end
  return rows
end

-- Sends the batch and returns the answers in the order of the queries, and the protocol's result. `view` asks for a
-- revision: { at_least = N } or { exactly = N }. The builder is empty afterwards.
function Queries:run(view)
  local blocks = {}
  for i, entry in ipairs(self.blocks) do
    for name, value in pairs(self.options) do
      if entry.block[name] == nil then entry.block[name] = value end
    end
    blocks[i] = entry.block
  end
  local result = self.scene:query{ view = view, blocks = blocks }
  for _, answer in ipairs(result.blocks) do
    answer.first_rows = {}
    local first = 1
    for n, count in ipairs(answer.counts) do
      answer.first_rows[n] = first
      first = first + count
    end
  end
  local answers = {}
  for i, place in ipairs(self.places) do answers[i] = answer_of(result.blocks[place[1]], place[2]) end
  self.blocks, self.places = {}, {}
  return answers, result
end

-- Expectations. An expectation that is not met ends the script, or with --keep-going is counted and written.
local function shown(value)
  if type(value) ~= "table" then return tostring(value) end
  local parts = {}
  for i, part in ipairs(value) do parts[i] = shown(part) end
  return "{" .. table.concat(parts, ", ") .. "}"
end

local function near(got, wanted, within)
  if type(wanted) == "table" then
    if type(got) ~= "table" or #got ~= #wanted then return false end
    for i = 1, #wanted do
      if not near(got[i], wanted[i], within) then return false end
    end
    return true
  end
  if within == 0 or type(got) ~= "number" or type(wanted) ~= "number" then return got == wanted end
  return math.abs(got - wanted) <= within
end

function locus.expect(condition, message)
  internal.count(condition and true or false, message or "the condition is not true")
  return condition
end

function locus.expect_equal(got, wanted, message)
  local prefix = message and message .. ": " or ""
  internal.count(near(got, wanted, 0), prefix .. "expected " .. shown(wanted) .. ", but it is " .. shown(got))
  return got
end

function locus.expect_near(got, wanted, within, message)
  local prefix = message and message .. ": " or ""
  internal.count(near(got, wanted, within),
    prefix .. "expected " .. shown(wanted) .. " within " .. shown(within) .. ", but it is " .. shown(got))
  return got
end

-- Expects that f(...) raises an error with this reason or status code. Returns the error.
function locus.expect_error(reason, f, ...)
  local ok, err = pcall(f, ...)
  if ok then
    internal.count(false, "expected " .. reason .. ", but it succeeded")
    return nil
  end
  local found = type(err) == "userdata" and err.reason or "an error of Lua"
  local met = type(err) == "userdata" and (err.reason == reason or err.code == reason)
  internal.count(met, "expected " .. reason .. ", but it is " .. found .. ": " .. tostring(err))
  return err
end
