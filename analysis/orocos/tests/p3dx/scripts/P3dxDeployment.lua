-- Deployment `exploration.P3dxDeployment` of architecture
-- `exploration.ExplorationP3dxArchitecture` (deployment.mal:4).
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
import("rtt_geometry_msgs")
import("rtt_nav_msgs")
import("rtt_sensor_msgs")
import("rtt_std_msgs")

-- The components.
import("drivers")
import("motion")
import("localisation")
import("navigation")
import("exploration")

-- The instances.
load("navigation", "navigation::Navigation")
load("control", "motion::Control")
load("guidance", "motion::Guidance")
load("switch", "motion::Switch")
load("teleop", "drivers::Teleop")
load("pose", "localisation::Pose")
load("gmapping", "localisation::Gmapping")
load("p3dx_driver", "drivers::P3dxDriver")
load("hokuyo", "drivers::Hokuyo")
load("exploration", "exploration::Exploration")

-- Values that the model sets, and those that rest on them.
set("control", "max_speed", 0.4)
set("guidance", "body_width", 0.5800000000000001)
set("switch", "body_width", 0.48)
set("teleop", "device", "/dev/input/js0")
set("teleop", "max_speed", 0.5)
set("gmapping", "max_range", 4.0)
set("p3dx_driver", "device", "/dev/ttyS0")
set("hokuyo", "device", "/dev/ttyACM0")
set("hokuyo", "min_angle", -2.09)
set("hokuyo", "max_angle", 2.09)

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

connect("hokuyo.scan", "switch.scan")
connect("hokuyo.scan", "guidance.scan")
connect("hokuyo.scan", "gmapping.scan")
connect("p3dx_driver.odometry", "pose.odometry")
connect("p3dx_driver.odometry", "gmapping.odometry")
connect("switch.command", "p3dx_driver.command")
connect("gmapping.map", "exploration.map")
connect("pose.pose", "exploration.pose")
connect("exploration.goal", "navigation.goal")
connect("navigation.next", "control.target")
connect("control.command", "guidance.wanted")
connect("guidance.command", "switch.automatic")
connect("teleop.command", "switch.manual", 4)
connect("gmapping.correction", "pose.correction")
connect("gmapping.map", "navigation.map")
connect("pose.pose", "navigation.pose")
connect("pose.pose", "control.pose")

-- How they run: period in seconds, priority, scheduler; and on which CPUs, a bit for each.
assert(deployer:setActivity("navigation", 1.0, 2, rtt.globals.ORO_SCHED_RT))
task("navigation"):setCpuAffinity(1)
assert(deployer:setActivity("control", 0.1, 5, rtt.globals.ORO_SCHED_RT))
task("control"):setCpuAffinity(1)
assert(deployer:setActivity("guidance", 0.1, 6, rtt.globals.ORO_SCHED_RT))
task("guidance"):setCpuAffinity(1)
assert(deployer:setActivity("switch", 0.1, 8, rtt.globals.ORO_SCHED_RT))
task("switch"):setCpuAffinity(1)
assert(deployer:setActivity("teleop", 0.1, 4, rtt.globals.ORO_SCHED_RT))
task("teleop"):setCpuAffinity(1)
assert(deployer:setActivity("pose", 0.1, 7, rtt.globals.ORO_SCHED_RT))
task("pose"):setCpuAffinity(1)
assert(deployer:setActivity("gmapping", 1.0, 3, rtt.globals.ORO_SCHED_RT))
task("gmapping"):setCpuAffinity(2)
assert(deployer:setActivity("p3dx_driver", 0.1, 10, rtt.globals.ORO_SCHED_RT))
task("p3dx_driver"):setCpuAffinity(1)
assert(deployer:setActivity("hokuyo", 0.1, 9, rtt.globals.ORO_SCHED_RT))
task("hokuyo"):setCpuAffinity(1)
-- In the background, and the model gives no period. Without one RTT would run it only once, so 100
-- ms are assumed: a `period` in its activity says another.
assert(deployer:setActivity("exploration", 0.1, 0, rtt.globals.ORO_SCHED_OTHER))

-- Outputs are topics, and inputs that nothing is connected to. On the other inputs a topic would
-- be a second writer.
local ros = rtt.provides("ros"):provides("comm")
deployer:stream("navigation.next", ros:topic("/navigation/next"))
deployer:stream("control.command", ros:topic("/control/command"))
deployer:stream("guidance.command", ros:topic("/guidance/command"))
deployer:stream("switch.command", ros:topic("/switch/command"))
deployer:stream("teleop.command", ros:topic("/teleop/command"))
deployer:stream("pose.pose", ros:topic("/pose/pose"))
deployer:stream("gmapping.map", ros:topic("/gmapping/map"))
deployer:stream("gmapping.correction", ros:topic("/gmapping/correction"))
deployer:stream("p3dx_driver.odometry", ros:topic("/p3dx_driver/odometry"))
deployer:stream("hokuyo.scan", ros:topic("/hokuyo/scan"))
deployer:stream("exploration.goal", ros:topic("/exploration/goal"))
deployer:stream("exploration.explored", ros:topic("/exploration/explored"))

-- All are configured, and only if that succeeds for all, they start: who provides operations
-- before who requires them.
local order = {
  "navigation",
  "control",
  "guidance",
  "switch",
  "teleop",
  "pose",
  "gmapping",
  "p3dx_driver",
  "hokuyo",
  "exploration",
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
