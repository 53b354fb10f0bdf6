-- A game: each tick is one step, which moves all players and then casts a ray from player 1. At the end a ball finds
-- neighbours.
local players = tonumber(args.players or 8)
local ticks = tonumber(args.ticks or 5)
local game = locus.scene("game")
game:delete{ if_present = true }
game:create()

local start = game:updates()
for i = 1, players do
  start:insert{ id = i, at = { (i - 1) * 4, 0, 0 }, capsule = { axis = { 0, 0, 0.6 }, radius = 0.3 }, group = i }
end
locus.expect_equal(start:commit{ tick = 1 }.applied, players)

for tick = 2, ticks + 1 do
  local moves = game:updates()
  for i = 1, players do moves:move{ id = i, at = { (i - 1) * 4, tick, 0 } } end
  -- Player 1 looks along the row.
  local look = game:queries():ray{ from = { 0, tick, 0 }, dir = { 1, 0, 0 }, ignore_group = 1 }
  local answers, result, ack = game:step{ updates = moves, queries = look, tick = tick }
  locus.expect_equal(ack.tick, tick)
  locus.expect_equal(answers[1].id, 2)
  locus.expect_near(answers[1].t, 3.7, 1e-5)
  locus.expect_equal(result.revision, ack.revision)
end

-- Steps of a stream, sent without waiting for each answer.
local steps = game:query_stream()
for tick = ticks + 2, 2 * ticks + 1 do
  steps:step({ tick = tick, moves = { ids = { 1 }, positions_f64 = { { 0, tick, 0 } } } },
    { blocks = { columns = { "pose" }, lookup = { ids = { 1 } } } })
end
for i, step in ipairs(steps:close()) do
  locus.expect_equal(step.ack.tick, ticks + 1 + i)
  locus.expect_equal(step.result.blocks[1].positions[2], ticks + 1 + i)
end

-- A stream of updates alone.
local stream = game:update_stream()
for tick = 2 * ticks + 2, 3 * ticks + 1 do
  stream:send{ tick = tick, moves = { ids = { 1 }, positions_f64 = { { 0, tick, 0 } } } }
end
local acks = stream:close()
locus.expect_equal(#acks, ticks)
locus.expect_equal(acks[#acks].tick, 3 * ticks + 1)

game:updates():remove(players):commit()
locus.expect_error("NOT_FOUND", function() locus.command("get game --id", players) end)
locus.expect_error("UNKNOWN_ID", function()
  game:updates():move{ id = 1, at = { 0, 0, 0 } }:move{ id = players, at = { 0, 0, 0 } }:commit()
end)
local moved = game:queries():ball{ at = { 0, 0, 0 }, radius = 1 }:run({ at_least = game:describe().revision })
locus.expect_equal(moved[1][1].id, 1)
game:delete()
