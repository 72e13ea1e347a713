-- Deployment `arm.D` of architecture `arm.Two` (robot.mal:38).
-- Generated from the model: what is changed here is lost.

require("rttlib")

local deployer = rtt.getTC()
if deployer:getName() ~= "Deployer" then
  deployer = assert(deployer:getPeer("Deployer"), "there is no Deployer")
end

local function worked(has_worked, what)
  if not has_worked then
    error("Cannot " .. what .. "\nNothing runs.", 0)
  end
end

-- Beside the folder of a package, the deployer takes that for what is installed of it.
local function import(package)
  local is_there = deployer:import(package) or deployer:import("gnulinux/" .. package)
  worked(is_there, "import package " .. package .. ": build it, and source its workspace")
end

local function load(name, class)
  local is_loaded = deployer:loadComponent(name, class)
  worked(is_loaded, "load " .. name .. ", a " .. class .. ": build its package anew")
end

local function task(name)
  return assert(deployer:getPeer(name), "there is no " .. name)
end

local function set(name, property, value)
  local found = assert(task(name):getProperty(property), name .. " has no " .. property)
  found:set(value)
end

-- ROS, and the types of the messages.
-- Topics need rtt_ros_integration. Without them: `[generate] ros_streams = false` in mauve.toml.
import("rtt_ros")
import("rtt_rosnode")
import("rtt_roscomm")
import("rtt_std_msgs")

-- The components.
import("arm")

-- The instances, who provides operations before who requires them: the deployer stops them the
-- other way round.
load("arm", "arm::Arm")
load("last_3", "arm::Gripper")
load("mal_true_hand", "arm::Hand")

-- Values that the model sets, and those that rest on them.
set("arm", "label", "a \"b\" \\ $(evil) ${EVIL} \010\009// */ --> gr\195\182\195\159er")
set("arm", "start_", -2147483648)
set("mal_true_hand", "reach", 3.0)
set("mal_true_hand", "far", 6.0)
set("mal_true_hand", "near", 0.25)
set("mal_true_hand", "last", 6.25)

-- Values of this launch: NAME.cpf in the folder MAUVE_VALUES, for each that has properties.
local values = os.getenv("MAUVE_VALUES") or ""

local function read(name)
  local what = "use the values in " .. name .. ".cpf"
  worked(deployer:loadService(name, "marshalling"), what)
  if values ~= "" then
    local marshalling = task(name):provides("marshalling")
    worked(marshalling:updateProperties(values .. "/" .. name .. ".cpf"), what)
  end
end

read("arm")
read("mal_true_hand")

-- The connections: from an output to an input, which keeps the last value or so many.
local function connect(from, to, size, what)
  local policy = rtt.Variable("ConnPolicy")
  if size then
    policy.type = rtt.globals.CIRCULAR_BUFFER
    policy.size = size
  else
    policy.type = rtt.globals.DATA
  end
  worked(deployer:connect(from, to, policy), what)
end

connect("arm.done_", "mal_true_hand.told", 3, "connect arm.done_ and mal_true_hand.told")

-- The operations: who requires it, who provides it.
worked(deployer:connectOperations("mal_true_hand.grip", "last_3.grip"), "connect mal_true_hand.grip and last_3.grip")

-- How they run: period in seconds, priority, scheduler; and on which CPUs, a bit for each. Each
-- then looks whether its thread has that.
worked(deployer:setActivity("arm", 0.033333333, 9, rtt.globals.ORO_SCHED_RT), "give arm its activity")
worked(task("arm"):setCpuAffinity(3), "give arm its CPUs: are they all there?")
worked(task("arm"):mauve_runs_as(9, 3), "start arm")
worked(deployer:setActivity("mal_true_hand", 0.25, 0, rtt.globals.ORO_SCHED_OTHER), "give mal_true_hand its activity")
worked(deployer:setWaitPeriodPolicy("mal_true_hand", rtt.globals.ORO_WAIT_REL), "give mal_true_hand its activity")
worked(task("mal_true_hand"):mauve_runs_as(0, 0), "start mal_true_hand")
-- In the background, and the model gives no period: it runs again 10 ms after it began, or when it
-- has ended. A `period` in its activity says another time.
worked(deployer:setActivity("last_3", 0.01, 0, rtt.globals.ORO_SCHED_OTHER), "give last_3 its activity")
worked(deployer:setWaitPeriodPolicy("last_3", rtt.globals.ORO_WAIT_REL), "give last_3 its activity")
worked(task("last_3"):setCpuAffinity(2), "give last_3 its CPUs: are they all there?")
worked(task("last_3"):mauve_runs_as(0, 2), "start last_3")

-- Outputs are topics, and inputs that nothing is connected to. On the other inputs a topic would
-- be a second writer.
local ros = rtt.provides("ros"):provides("comm")
worked(deployer:stream("arm.goal", ros:topic("arm/goal")), "make topic arm/goal: does roscore run?")
worked(deployer:stream("arm.done_", ros:topic("arm/done")), "make topic arm/done: does roscore run?")
worked(deployer:stream("mal_true_hand.goal", ros:topic("true_hand/goal")), "make topic true_hand/goal: does roscore run?")
worked(deployer:stream("mal_true_hand.done_", ros:topic("true_hand/done")), "make topic true_hand/done: does roscore run?")
worked(deployer:stream("arm.period", ros:topic("arm/period")), "make topic arm/period: does roscore run?")
worked(deployer:stream("mal_true_hand.period", ros:topic("true_hand/period")), "make topic true_hand/period: does roscore run?")
worked(deployer:stream("last_3.period", ros:topic("last_3/period")), "make topic last_3/period: does roscore run?")
-- Not arm.device: no message has its type.
-- Not mal_true_hand.device: no message has its type.

-- Where all that has worked, all are configured.
worked(task("arm"):configure(), "configure arm")
worked(task("last_3"):configure(), "configure last_3")
worked(task("mal_true_hand"):configure(), "configure mal_true_hand")

-- They start, unless MAUVE_START is false: who provides operations before who requires them. Where
-- one does not start, all are stopped again.
local order = {
  "arm",
  "last_3",
  "mal_true_hand",
}

local function stop(last)
  for index = last, 1, -1 do
    task(order[index]):stop()
  end
end

if os.getenv("MAUVE_START") ~= "false" then
  for index, name in ipairs(order) do
    if not task(name):start() then
      stop(index - 1)
      worked(false, "start " .. name)
    end
  end
end
