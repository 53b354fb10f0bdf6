-- Assertions about a level, as a build of a game runs them: the ground is closed, spawn points are free, and every
-- return of a turning scanner lies on its ray. `--set scene=NAME` checks a scene that exists instead of a made-up city.
local level = locus.scene(args.scene or "level-checks")
local made_up = args.scene == nil
if made_up then
  level:delete{ if_present = true }
  locus.command("generate city --triangles 5000 --seed 1 --create --scene", level.name)
  locus.command("wait", level.name)
end
local about = level:describe()
local low, high = about.min, about.max

-- Every ray from above finds ground.
local rays = level:queries{ columns = { "t", "id", "point" }, source = "static" }
local steps <const> = 16
for i = 1, steps do
  for j = 1, steps do
    local x = low.x + (high.x - low.x) * (i - 0.5) / steps
    local y = low.y + (high.y - low.y) * (j - 0.5) / steps
    rays:ray{ from = { x, y, high.z + 1 }, dir = { 0, 0, -1 } }
  end
end
local ground = rays:run()
for i, hit in ipairs(ground) do locus.expect(hit, "ray " .. i .. " from above falls through the level") end

-- A player fits above the ground that the rays found.
local bodies = level:queries{ source = "static" }
local bodies_at = {}
for _, hit in ipairs(ground) do
  local x, y, z = table.unpack(hit.point)
  bodies:capsule{ from = { x, y, z + 0.5 }, to = { x, y, z + 1.5 }, radius = 0.4 }
  bodies_at[#bodies_at + 1] = { x, y, z }
end
local free = 0
for _, found in ipairs(bodies:run()) do
  if #found == 0 then free = free + 1 end
end
locus.expect(free >= steps * steps // 4, "only " .. free .. " of " .. steps * steps .. " places are free for a player")

-- A turning scanner: each return lies on its ray.
local mast = { (low.x + high.x) / 2, (low.y + high.y) / 2, high.z + 5 }
local scan = level:queries{ columns = { "t", "id", "point" }, source = "static" }
local beams = {}
for i = 1, 36 do
  local angle = 2 * math.pi * i / 36
  local dir = { math.cos(angle), math.sin(angle), -2 }
  beams[i] = dir
  scan:ray{ from = mast, dir = dir }
end
for i, hit in ipairs(scan:run()) do
  if hit then
    local dir = beams[i]
    locus.expect_near(hit.point, { mast[1] + hit.t * dir[1], mast[2] + hit.t * dir[2], mast[3] + hit.t * dir[3] }, 1e-3)
  end
end
if made_up then level:delete() end
