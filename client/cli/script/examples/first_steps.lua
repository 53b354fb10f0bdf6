-- A scene, a batch, and what a ray finds: locus run first_steps.lua --set scene=demo
local arena = locus.scene(args.scene or "first-steps")
local radius = 0.5
arena:delete{ if_present = true }
arena:create()

-- One batch is one revision.
local updates = arena:updates()
updates:insert{ id = 7, at = { 0, 0, 30 }, ball = radius, group = 3 }
updates:insert{ id = 8, at = { 10, 0, 0 }, box = { 1, 1, 2 } }
for i = 0, 4 do updates:insert{ id = 100 + i, at = { i * 2, 50, 0 } } end
local ack = updates:commit{ tick = 1 }
locus.expect_equal(ack.applied, 7)
locus.expect_equal(ack.revision, 1)

-- Queries see the changes of the script.
local queries = arena:queries{ columns = { "t", "id", "point" } }
queries:ray{ from = { 0, 0, 100 }, dir = { 0, 0, -1 } }
queries:ray{ from = { 0, 0, 100 }, dir = { 0, 0, 1 } }
queries:ball{ at = { 4, 50, 0 }, radius = 2 }
local answers = queries:run()
local shot, miss, near = answers[1], answers[2], answers[3]
locus.expect_equal(shot.id, 7)
locus.expect_near(shot.t, 100 - 30 - radius, 1e-5)
locus.expect_near(shot.point, { 0, 0, 30 + radius }, 1e-5)
locus.expect_equal(miss, false)
locus.expect_equal(#near, 3)
locus.expect_equal(near[1].id, 101)

-- Any command of locus works, too.
arena:updates():move{ id = 7, at = { shot.point[1], shot.point[2], shot.point[3] + 9.5 } }:commit()
local ball = locus.command("get", arena.name, "--id", 7)
locus.expect_equal(ball.position, { 0, 0, 40 })

locus.expect_error("UNKNOWN_ID", function() arena:updates():move{ id = 999, at = { 0, 0, 0 } }:commit() end)
locus.expect_error("NOT_FOUND", function() locus.command("query ball nowhere --at 0,0,0 --radius 1") end)
