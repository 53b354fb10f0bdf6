-- A spinning lidar: the pattern of beams is made once; each sweep sends it with one origin and the sensor's rotation.
local beams = tonumber(args.beams or 360)
local street = locus.scene("street")
street:delete{ if_present = true }
street:create()
street:updates()
  :insert{ id = 1, at = { 0, 0, 0 }, box = { 1, 0.5, 0.5 }, group = 9 } -- the car that carries the sensor
  :insert{ id = 2, at = { 10, 0, 0 }, box = { 1, 1, 1 }, tag = 3 }
  :insert{ id = 3, at = { 0, 20, 0 }, ball = 2, tag = 3 }
  :commit()

local pattern = {}
for i = 1, beams do
  local yaw = 2 * math.pi * (i - 1) / beams
  pattern[i] = { math.cos(yaw), math.sin(yaw), 0 }
end

-- Returns the distances that the sensor measures when it is turned by `yaw`, without what its own car hides.
local function sweep(yaw, filters)
  local block = {
    columns = { "t", "id" }, ignore_groups = { 9 }, rotation = { 0, 0, math.sin(yaw / 2), math.cos(yaw / 2) },
    rays = { origins = { 0, 0, 0 }, directions = pattern, t_max = { 100 } },
  }
  for name, value in pairs(filters or {}) do block[name] = value end
  return street:query{ blocks = { block } }.blocks[1]
end

local ahead = sweep(0)
locus.expect_equal(#ahead.t, beams)
locus.expect_equal(ahead.ids[1], 2)
locus.expect_near(ahead.t[1], 9, 1e-5)
local left = sweep(math.pi / 2)
locus.expect_equal(left.ids[1], 3)
locus.expect_near(left.t[1], 18, 1e-4)
locus.expect_equal(sweep(0, { self_ids = { 2 } }).ids[1], 0)
locus.expect_equal(sweep(0, { only_groups = { 5 } }).ids[1], 0)
locus.expect_equal(sweep(0, { tags = { 1 }, tag_masks = { 1 } }).ids[1], 2)
locus.expect_error("MALFORMED", sweep, 0, { tag_masks = { 1 } })
street:delete()
