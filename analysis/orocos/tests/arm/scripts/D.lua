-- Deployment `arm.D` of architecture `arm.Two` (robot.mal:38).
-- Generated from the model: what is changed here is lost.

require("rttlib")

local deployer = rtt.getTC()
if deployer:getName() ~= "Deployer" then
  deployer = assert(deployer:getPeer("Deployer"), "there is no Deployer")
end

local function import(package)
  assert(deployer:import(package), "cannot import " .. package)
end

local function load(name, class)
  assert(deployer:loadComponent(name, class), "cannot load " .. name .. ", a " .. class)
end

local function task(name)
  return assert(deployer:getPeer(name), "there is no " .. name)
end

local function set(name, property, value)
  local found = assert(task(name):getProperty(property), name .. " has no " .. property)
  found:set(value)
end

-- ROS, and the types of the messages.
import("rtt_ros")
import("rtt_rosnode")
import("rtt_roscomm")
import("rtt_std_msgs")

-- The components.
import("arm")

-- The instances.
load("arm", "arm::Arm")
load("mal_true_hand", "arm::Hand")
load("last_3", "arm::Gripper")

-- Values that the model sets, and those that rest on them.
set("arm", "label", "a \"b\" \\ $(evil) ${EVIL} \010\009// */ --> gr\195\182\195\159er")
set("arm", "start_", -2147483648)
set("mal_true_hand", "reach", 3.0)
set("mal_true_hand", "far", 6.0)
set("mal_true_hand", "near", 0.25)
set("mal_true_hand", "last", 6.25)

-- The connections: from an output to an input, which keeps the last value or so many.
local function connect(from, to, size)
  local policy = rtt.Variable("ConnPolicy")
  if size then
    policy.type = rtt.globals.CIRCULAR_BUFFER
    policy.size = size
  else
    policy.type = rtt.globals.DATA
  end
  assert(deployer:connect(from, to, policy), "cannot connect " .. from .. " to " .. to)
end

connect("arm.done_", "mal_true_hand.told", 3)

-- The operations: who requires it, who provides it.
assert(deployer:connectOperations("mal_true_hand.grip", "last_3.grip"))

-- How they run: period in seconds, priority, scheduler; and on which CPUs, a bit for each.
assert(deployer:setActivity("arm", 0.033333333, 9, rtt.globals.ORO_SCHED_RT))
task("arm"):setCpuAffinity(3)
assert(deployer:setActivity("mal_true_hand", 0.25, 0, rtt.globals.ORO_SCHED_OTHER))
-- In the background, and the model gives no period. Without one RTT would run it only once, so 100
-- ms are assumed: a `period` in its activity says another.
assert(deployer:setActivity("last_3", 0.1, 0, rtt.globals.ORO_SCHED_OTHER))
task("last_3"):setCpuAffinity(2)

-- Outputs are topics, and inputs that nothing is connected to. On the other inputs a topic would
-- be a second writer.
local ros = rtt.provides("ros"):provides("comm")
deployer:stream("arm.goal", ros:topic("/arm/goal"))
deployer:stream("arm.done_", ros:topic("/arm/done"))
deployer:stream("mal_true_hand.goal", ros:topic("/true_hand/goal"))
deployer:stream("mal_true_hand.done_", ros:topic("/true_hand/done"))
-- Not arm.device: no message has its type.
-- Not mal_true_hand.device: no message has its type.

-- All are configured, and only if that succeeds for all, they start: who provides operations
-- before who requires them.
local order = {
  "arm",
  "last_3",
  "mal_true_hand",
}

local failed = {}
for _, name in ipairs(order) do
  if not task(name):configure() then
    failed[#failed + 1] = name
  end
end
assert(#failed == 0, "nothing starts, because these cannot be configured: " .. table.concat(failed, ", "))

for _, name in ipairs(order) do
  assert(task(name):start(), name .. " does not start")
end
