-- Hit boxes: players that are compounds of parts, moved with their bones in one batch, and shots into the past that name
-- the part that they hit. Shots that have left the scene expire.
local players = tonumber(args.players or 64)
local body <const>, head <const> = 1, 2 -- layers
local game = locus.scene("hit-boxes")
game:delete{ if_present = true }
game:create{ history_ticks = 64 }

-- The parts are numbered from 0 in this order.
local names <const> = { "head", "chest", "left arm", "right arm", "left leg", "right leg" }
local rig <const> = {
  { ball = 0.13, at = { 0, 0, 1.65 }, layers = head },
  { box = { 0.18, 0.12, 0.3 }, at = { 0, 0, 1.15 }, layers = body },
  { capsule = { axis = { 0, 0, 0.25 }, radius = 0.06 }, at = { -0.28, 0, 1.1 }, layers = body },
  { capsule = { axis = { 0, 0, 0.25 }, radius = 0.06 }, at = { 0.28, 0, 1.1 }, layers = body },
  { capsule = { axis = { 0, 0, 0.35 }, radius = 0.08 }, at = { -0.1, 0, 0.43 }, layers = body },
  { capsule = { axis = { 0, 0, 0.35 }, radius = 0.08 }, at = { 0.1, 0, 0.43 }, layers = body },
}

local function place(player, tick) return { 3 * ((player - 1) % 8), 4 * ((player - 1) // 8) + 0.1 * tick, 0 } end

local start = game:updates()
for player = 1, players do start:insert{ id = player, at = place(player, 1), compound = rig, group = player } end
start:insert{ id = players + 1, at = { -100, 0, 0 }, ball = 0.1, expire_ticks = 5 }
locus.expect_equal(start:commit{ tick = 1 }.applied, players + 1)

for tick = 2, 10 do
  -- From tick 6 on all players duck: the head and the chest go down.
  local poses = {}
  for i, part in ipairs(rig) do
    local down = (tick >= 6 and i <= 2) and 0.4 or 0
    poses[i] = { at = { part.at[1], part.at[2], part.at[3] - down } }
  end
  local moves = game:updates()
  for player = 1, players do moves:move{ id = player, at = place(player, tick), parts = poses } end
  locus.expect_equal(moves:commit{ tick = tick }.refused, 0)
end
locus.expect_error("NOT_FOUND", function() locus.command("get", game.name, "--id", players + 1) end)

-- Returns the name of the part of player 1 that a shot along x hits at a tick of the past.
local function shot(tick, height, mask)
  local at = place(1, tick)
  local hit = game:queries{ as_of_ticks = { tick }, columns = { "id", "triangle" } }
    :ray{ from = { at[1] - 1, at[2], height }, dir = { 1, 0, 0 }, t_max = 2, mask = mask }:run()[1]
  return hit and hit.id == 1 and names[hit.triangle + 1] or "nothing"
end
locus.expect_equal(shot(5, 1.65, body | head), "head")
locus.expect_equal(shot(5, 1.65, body), "nothing")
locus.expect_equal(shot(8, 1.65, body | head), "nothing")
locus.expect_equal(shot(8, 1.25, head), "head")
locus.expect_equal(shot(8, 0.1, body | head), "left leg")

-- A change in several messages is one revision, and objects of a stream with a lease go with the stream.
local stream = game:update_stream{ lease_ms = 60000 }
local before = game:describe().revision
stream:send_together{ { remove_ids = { players } }, { tick = 11, inserts = { { ids = { 900 }, positions = { 0, 0, 9 }, point = {} } } } }
local acks = stream:close()
locus.expect_equal(acks[1].applied, 2)
locus.expect_equal(acks[1].revision, before + 1)
game:delete()
