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
-- Changes settings of the scene: cell_size and labels, which replace all labels.
function Scene:update(settings)
  local request = { name = self.name, fields = {} }
  for name, value in pairs(settings) do
    request.fields[#request.fields + 1] = name
    request[name] = value
  end
  return self.server:update_scene(request)
end
function Scene:describe() return self.server:get_scene(self.name) end
function Scene:apply(batch) return self.server:apply(self.name, batch) end
function Scene:query(batch) return self.server:query(self.name, batch) end
function Scene:update_stream(options) return self.server:update_stream(self.name, options) end
function Scene:query_stream(options) return self.server:query_stream(self.name, options) end
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
local function empty_batch()
  return { inserts = {}, moves = {}, remove_ids = {}, remove_groups = {}, relabels = {}, instance_moves = {},
    instance_relabels = {} }
end
function Scene:updates() return setmetatable({ scene = self, shapes = {}, compounds = {}, batch = empty_batch() }, Updates) end

local no_rotation <const> = { 0, 0, 0, 1 }
-- Returns the field `name` of a row, a list of `width` numbers; nil if it is absent and not needed.
local function vector(what, row, name, width, is_needed)
  local value = row[name]
  if value == nil and not is_needed then return nil end
  if type(value) ~= "table" or #value ~= width then
    locus.fail(what .. ": " .. name .. " is a list of " .. width .. " numbers")
  end
  return value
end

-- Returns the field `name` of a row, which is no table; `default` if it is absent.
local function scalar(what, row, name, default)
  local value = row[name]
  if value == nil then return default end
  if type(value) == "table" then locus.fail(what .. ": " .. name .. " is one value, not a table") end
  return value
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

local insert_fields <const> = fields("id at rotation layers group tag expire_ticks point ball box capsule compound")
local capsule_fields <const> = fields("axis radius")
local part_fields <const> = fields("at rotation layers ball box capsule")

-- Returns the radius and the size of the ball, box or capsule in a row or a part.
local function measures_of(what, row, shape)
  if shape == "ball" then return scalar(what, row, "ball") end
  if shape == "box" then return nil, vector(what, row, "box", 3, true) end
  if shape ~= "capsule" then return end
  check_fields("capsule", row.capsule, capsule_fields)
  return needed("capsule", row.capsule, "radius") and scalar("capsule", row.capsule, "radius"),
    vector("capsule", row.capsule, "axis", 3, true)
end

-- Returns the one field of `row` that is among the names of shapes; nil if there is none.
local function shape_in(what, row, names)
  local shapes = {}
  for _, name in ipairs(names) do
    if row[name] then shapes[#shapes + 1] = name end
  end
  if #shapes > 1 then locus.fail(what .. " has one shape, not " .. table.concat(shapes, " and ")) end
  return shapes[1]
end

-- Returns the protocol's Compound of a list of parts. Part 0 is the first.
local function compound_of(list)
  if type(list) ~= "table" or #list == 0 then locus.fail("insert: compound is a list of parts") end
  local parts = {}
  for i, part in ipairs(list) do
    check_fields("part", part, part_fields)
    local shape = shape_in("part: a part", part, { "ball", "box", "capsule" })
    if not shape then locus.fail("part needs ball, box or capsule") end
    local radius, size = measures_of("part", part, shape)
    parts[i] = { positions = { vector("part", part, "at", 3, true) },
      rotations = part.rotation and { vector("part", part, "rotation", 4) } or nil,
      layers = part.layers and { scalar("part", part, "layers") } or nil,
      [shape] = { radii = radius and { radius } or nil, [shape == "box" and "half_extents" or "half_axes"] = size and { size } or nil } }
  end
  return { parts = parts }
end

function Updates:insert(row)
  check_fields("insert", row, insert_fields)
  local shape = shape_in("insert: an object", row, { "point", "ball", "box", "capsule", "compound" }) or "point"
  local id, at = scalar("insert", row, "id"), vector("insert", row, "at", 3, true)
  needed("insert", row, "id")
  local rotation = vector("insert", row, "rotation", 4) or no_rotation
  -- Without layers, a compound is in all layers of its parts.
  local layers = scalar("insert", row, "layers", shape ~= "compound" and 1 or nil)
  local group, tag = scalar("insert", row, "group", 0), scalar("insert", row, "tag", 0)
  local expire_ticks = scalar("insert", row, "expire_ticks")
  local radius, size = measures_of("insert", row, shape)
  -- Compounds of one list of parts share an entry if all or none of them have layers.
  local key = shape
  if shape == "compound" then
    self.compounds[row.compound] = self.compounds[row.compound] or {}
    key = self.compounds[row.compound]
    key[1], key[2] = key[1] or {}, key[2] or {}
    key = key[layers and 1 or 2]
  end
  local insert = self.shapes[key]
  local compound = not insert and shape == "compound" and compound_of(row.compound)
  -- Everything is checked: a refused row adds nothing.
  if not insert then
    insert = { ids = {}, positions_f64 = {}, rotations = {}, layers = layers and {}, groups = {}, tags = {},
      [shape] = compound or {} }
    self.shapes[key] = insert
    table.insert(self.batch.inserts, insert)
  end
  local n = #insert.ids + 1
  insert.ids[n], insert.positions_f64[n], insert.rotations[n] = id, at, rotation
  insert.groups[n], insert.tags[n] = group, tag
  if layers then insert.layers[n] = layers end
  set_optional(insert, "expire_ticks", n, expire_ticks, 0)
  local columns = insert[shape]
  local size_column = shape == "box" and "half_extents" or "half_axes"
  if radius then
    columns.radii = columns.radii or {}
    columns.radii[n] = radius
  end
  if size then
    columns[size_column] = columns[size_column] or {}
    columns[size_column][n] = size
  end
  return self
end

local pose_fields <const> = fields("at rotation")
-- Returns the positions and the rotations of the poses of a compound's parts, each nil if no part has one.
local function poses_of(what, parts)
  if parts == nil then return end
  if type(parts) ~= "table" or #parts == 0 then locus.fail(what .. ": parts is a list of poses") end
  local positions, rotations = {}, {}
  for _, part in ipairs(parts) do
    check_fields("part", part, pose_fields)
    positions[#positions + 1] = vector("part", part, "at", 3)
    rotations[#rotations + 1] = vector("part", part, "rotation", 4)
  end
  if (#positions ~= #parts and #positions > 0) or (#rotations ~= #parts and #rotations > 0) or #positions + #rotations == 0 then
    locus.fail(what .. ": either all parts or none have at, and the same for rotation; one of them is needed")
  end
  return #positions > 0 and positions or nil, #rotations > 0 and rotations or nil
end

-- Adds a row to `moves`: to the last entry if that has the same columns, otherwise to a new one.
local function add_move(what, moves, row, scale)
  needed(what, row, "id")
  local id, at = scalar(what, row, "id"), vector(what, row, "at", 3, true)
  local rotation, teleport = vector(what, row, "rotation", 4), row.teleport or false
  local part_positions, part_rotations = poses_of(what, row.parts)
  local parts_each = row.parts and #row.parts
  local move = moves[#moves]
  local turns, scales = rotation ~= nil, scale ~= nil
  if not move or move.teleport ~= teleport or (move.rotations ~= nil) ~= turns or (move.scales ~= nil) ~= scales
    or move.parts_each ~= parts_each or (move.part_positions ~= nil) ~= (part_positions ~= nil)
    or (move.part_rotations ~= nil) ~= (part_rotations ~= nil) then
    move = { ids = {}, positions_f64 = {}, rotations = turns and {} or nil, scales = scales and {} or nil,
      teleport = teleport, parts_each = parts_each, part_positions = part_positions and {},
      part_rotations = part_rotations and {} }
    moves[#moves + 1] = move
  end
  local n = #move.ids + 1
  move.ids[n], move.positions_f64[n] = id, at
  if turns then move.rotations[n] = rotation end
  if scales then move.scales[n] = scale end
  for _, at in ipairs(part_positions or {}) do table.insert(move.part_positions, at) end
  for _, turn in ipairs(part_rotations or {}) do table.insert(move.part_rotations, turn) end
end

local move_fields <const> = fields("id at rotation teleport parts")
function Updates:move(row)
  check_fields("move", row, move_fields)
  add_move("move", self.batch.moves, row)
  return self
end

local instance_move_fields <const> = fields("id at rotation scale teleport")
function Updates:move_instance(row)
  check_fields("move_instance", row, instance_move_fields)
  add_move("move_instance", self.batch.instance_moves, row, scalar("move_instance", row, "scale"))
  return self
end

local relabel_fields <const> = fields("id layers group tag")
local function relabel_of(what, row)
  check_fields(what, row, relabel_fields)
  return { ids = { needed(what, row, "id") }, layers = row.layers, groups = row.group, tags = row.tag }
end

function Updates:relabel(row)
  table.insert(self.batch.relabels, relabel_of("relabel", row))
  return self
end

function Updates:relabel_instance(row)
  table.insert(self.batch.instance_relabels, relabel_of("relabel_instance", row))
  return self
end

local function one_value(what, value)
  if value == nil or type(value) == "table" then locus.fail(what .. " takes one value") end
  return value
end

function Updates:remove(id)
  table.insert(self.batch.remove_ids, one_value("remove", id))
  return self
end

function Updates:remove_group(group)
  table.insert(self.batch.remove_groups, one_value("remove_group", group))
  return self
end

-- Sends the batch with `options`, which are fields of the protocol's UpdateBatch, and returns the ack. The builder is
-- empty afterwards. The server applies removals, then inserts, moves and relabels, and those of instances last.
function Updates:commit(options)
  return self.scene:apply(self:take(options))
end

-- Returns the batch with `options`, and empties the builder.
function Updates:take(options)
  local batch = self.batch
  for name, value in pairs(options or {}) do batch[name] = value end
  self.shapes, self.compounds = {}, {}
  self.batch = empty_batch()
  return batch
end

-- Queries by row: one batch, answered at one revision. `options` are fields of the protocol's QueryBlock, such as
-- columns or frame.
local Queries = {}
Queries.__index = Queries
function Scene:queries(options)
  return setmetatable({ scene = self, options = options or {}, blocks = {}, places = {} }, Queries)
end

-- Kinds of queries: the kind's field in a block, the columns of needed fields, and the columns and defaults of others.
local kinds <const> = {
  ray = { block = "rays", needs = { from = "origins", dir = "directions" },
    takes = { t_max = { "t_max", math.huge } }, finds_first = true },
  ball = { block = "balls", needs = { at = "centers", radius = "radii" }, takes = {} },
  box = { block = "boxes", needs = { at = "centers", half = "half_extents" },
    takes = { rotation = { "rotations", no_rotation } } },
  capsule = { block = "capsules", needs = { from = "starts", to = "ends", radius = "radii" }, takes = {} },
  sweep = { block = "sweeps", needs = { from = "starts", to = "ends", radius = "radii" }, takes = {},
    finds_first = true },
  nearest = { block = "nearest", needs = { at = "points" }, takes = { max_distance = { "max_distances", math.huge } } },
  contains = { block = "contains", needs = { at = "points" }, takes = {} },
}
-- Options that are fields of the protocol's QueryBlock; other options are fields of the kind's message.
local block_options <const> = fields("frame source precision columns max_results after_id as_of_ticks as_of_fractions "
  .. "outside_history anchor_ids count_only only_groups only_groups_each ignore_ids rotation")
-- Numbers in a field of a row that is a list.
local widths <const> = { from = 3, dir = 3, to = 3, at = 3, half = 3, rotation = 4 }
local every_tag_bit <const> = locus.id("18446744073709551615")
-- Fields of a row of any kind: the column of the block, and the default.
local row_options <const> = {
  mask = { "masks", 0xFFFFFFFF }, ignore_group = { "ignore_groups", 0 }, ignore_id = { "self_ids", 0 },
  only_group = { "only_groups", 0 }, tag = { "tags", 0 }, tag_mask = { "tag_masks", 0 },
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
    if row.tag_mask ~= nil and row.tag == nil then locus.fail(kind .. ": tag_mask needs tag") end
    for name in pairs(description.needs) do needed(kind, row, name) end
    for name in pairs(known) do
      if widths[name] then vector(kind, row, name, widths[name]) else scalar(kind, row, name) end
    end
    local entry = self.blocks[kind]
    if entry and options then
      for name, value in pairs(options) do
        if entry.options[name] ~= value then
          locus.fail(kind .. ": option " .. name .. " holds for all queries of this kind in a batch: give it to the first")
        end
      end
    end
    if not entry then
      entry = { rows = 0, block = {}, columns = {}, options = options or {} }
      entry.block[description.block] = entry.columns
      for name, value in pairs(entry.options) do
        local target = block_options[name] and entry.block or entry.columns
        target[name] = value
      end
      entry.finds_first = description.finds_first
      self.blocks[kind] = entry
      self.blocks[#self.blocks + 1] = entry
      entry.number = #self.blocks
    end
    local n = entry.rows + 1
    for name, column in pairs(description.needs) do
      entry.columns[column] = entry.columns[column] or {}
      entry.columns[column][n] = row[name]
    end
    for name, column in pairs(description.takes) do set_optional(entry.columns, column[1], n, row[name], column[2]) end
    for name, column in pairs(row_options) do
      local value = row[name]
      -- A tag without a mask compares all bits; once a row has a tag, rows without one have the mask 0.
      if name == "tag_mask" and row.tag ~= nil and value == nil then value = every_tag_bit end
      set_optional(entry.block, column[1], n, value, column[2])
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
-- that ask for any hit, a boolean; with count_only, the number of rows; else the list of rows, with the field
-- `truncated` if it may lack rows.
local function answer_of(answer, n, counts_only)
  if #answer.hits > 0 then return answer.hits:byte(n) ~= 0 end
  if #answer.counts == 0 then
    local row = row_of(answer, n)
    return row.id ~= 0 and row
  end
  if counts_only then return answer.counts[n] end
  local rows = { truncated = answer.is_truncated[n] }
  for i = answer.first_rows[n], answer.first_rows[n] + answer.counts[n] - 1 do rows[#rows + 1] = row_of(answer, i) end
  return rows
end

-- Returns columns that contain the id, by which a miss is known.
local function with_id(columns)
  if columns == nil then return nil end
  local names = { "id" }
  for _, name in ipairs(columns) do
    if name:lower() ~= "id" and name ~= "COLUMN_ID" then names[#names + 1] = name end
  end
  return names
end

-- Sends the batch and returns the answers in the order of the queries, and the protocol's result. `view` asks for a
-- revision: { at_least = N } or { exactly = N }. `options` are further fields of the protocol's QueryBatch, such as
-- { by_list = true } or { explain = true }. The builder is empty afterwards.
function Queries:run(view, options)
  local batch, answers_in = self:take(view)
  for name, value in pairs(options or {}) do
    if batch[name] ~= nil then locus.fail("run: the option " .. name .. " is part of the batch") end
    batch[name] = value
  end
  local result = self.scene:query(batch)
  return answers_in(result), result
end

-- Returns the batch, and a function that returns the answers in a result; empties the builder.
function Queries:take(view)
  local entries, places = self.blocks, self.places
  self.blocks, self.places = {}, {}
  local blocks = {}
  for i, entry in ipairs(entries) do
    for name, value in pairs(self.options) do
      if entry.block[name] == nil then entry.block[name] = value end
    end
    if entry.finds_first then entry.block.columns = with_id(entry.block.columns) end
    blocks[i] = entry.block
  end
  local function answers_in(result)
    for _, answer in ipairs(result.blocks) do
      answer.first_rows, answer.is_truncated = {}, {}
      local first = 1
      for n, count in ipairs(answer.counts) do
        answer.first_rows[n] = first
        first = first + count
      end
      for _, query in ipairs(answer.truncated) do answer.is_truncated[query + 1] = true end
    end
    local answers = {}
    for i, place in ipairs(places) do
      answers[i] = answer_of(result.blocks[place[1]], place[2], blocks[place[1]].count_only)
    end
    return answers
  end
  return { view = view, blocks = blocks }, answers_in
end

-- Returns a copy of a table of the caller with one more field.
local function with_field(batch, name, value)
  local copy = {}
  for key, field in pairs(batch) do copy[key] = field end
  copy[name] = value
  return copy
end

local step_fields <const> = fields("updates queries tick view")
-- Makes a step: applies `updates` at `tick`, then answers `queries` at a revision that contains the updates, or at that
-- of `view`. Both are builders or batches in columns, and may be absent. Returns the answers (nil for a batch in
-- columns), the result and the ack.
function Scene:step(step)
  check_fields("step", step, step_fields)
  local updates, queries, answers_in = step.updates or {}, step.queries or {}, nil
  if getmetatable(updates) == Updates then updates = updates:take() end
  if getmetatable(queries) == Queries then queries, answers_in = queries:take() end
  if step.tick then updates = with_field(updates, "tick", step.tick) end
  if step.view then queries = with_field(queries, "view", step.view) end
  local result, ack = self.server:step(self.name, updates, queries)
  return answers_in and answers_in(result), result, ack
end

-- Expectations. An expectation that is not met ends the script, or with --keep-going is counted and written.
local most_nested <const> = 8
local function shown(value, depth)
  depth = depth or 1
  if type(value) == "string" then return '"' .. value .. '"' end
  if type(value) ~= "table" then return tostring(value) end
  if depth > most_nested then return "{...}" end
  local parts = {}
  for i, part in ipairs(value) do parts[i] = shown(part, depth + 1) end
  for key, part in pairs(value) do
    if math.type(key) ~= "integer" then parts[#parts + 1] = tostring(key) .. " = " .. shown(part, depth + 1) end
  end
  return "{" .. table.concat(parts, ", ") .. "}"
end

local function near(got, wanted, within, depth)
  if got == wanted then return true end
  depth = depth or 1
  if type(wanted) == "table" and type(got) == "table" and depth <= most_nested then
    for key, value in pairs(wanted) do
      if not near(got[key], value, within, depth + 1) then return false end
    end
    for key in pairs(got) do
      if wanted[key] == nil then return false end
    end
    return true
  end
  return within > 0 and type(got) == "number" and type(wanted) == "number" and math.abs(got - wanted) <= within
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
  if type(within) ~= "number" then locus.fail("expect_near takes GOT, WANTED and WITHIN, a number") end
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
