-- A stand-in for the Lua of Orocos, which only writes down what a script asks of it: a line for each call, its arguments
-- behind tabs, texts in hexadecimal. Whatever a script must not do is an error.
--
-- The variable FAILING names a call that fails, such as `configure arm`, or a property that is missing, such as
-- `getProperty arm.reach`.

local failing = os.getenv("FAILING") or ""
local imported, tasks, slaves, connected, active = {}, {}, {}, {}, {}

local function shown(value)
  if type(value) == "string" then
    return "t" .. value:gsub(".", function(byte) return string.format("%02x", byte:byte()) end):gsub("\n", "0a")
  elseif type(value) == "number" then
    return "n" .. string.format("%.17g", value)
  elseif type(value) == "boolean" then
    return "b" .. tostring(value)
  end
  error("an argument that is a " .. type(value))
end

local function done(name, ...)
  local line = { name }
  for index = 1, select("#", ...) do
    line[#line + 1] = shown((select(index, ...)))
  end
  print(table.concat(line, "\t"))
  return failing ~= name .. " " .. tostring((...))
end

local function check(count, ...)
  if select("#", ...) ~= count then
    error("expected " .. count .. " arguments", 3)
  end
end

-- A table that has these members, and no others.
local function closed(members)
  return setmetatable(members, { __index = function(_, name) error("there is no " .. tostring(name), 2) end })
end

local function of_task(path)
  local name = path:match("^([%a][%w_]*)%.[%a][%w_]*$")
  assert(name and rawget(tasks, name), path .. " is nothing of a task")
end

local function new_task(name)
  return closed({
    configure = function(_, ...) check(0, ...) return done("configure", name) end,
    start = function(_, ...) check(0, ...) return done("start", name) end,
    stop = function(_, ...) check(0, ...) return done("stop", name) end,
    mauve_executes = function(_, ...)
      check(1, ...)
      assert(slaves[(...)] == name, "no slave of this task")
      return done("mauve_executes", name, ...)
    end,
    mauve_has_buffer = function(_, ...) check(1, ...) return done("mauve_has_buffer", name, ...) end,
    mauve_is_not_preempted = function(_, ...) check(0, ...) return done("mauve_is_not_preempted", name, ...) end,
    mauve_released_by = function(_, ...)
      check(4, ...)
      assert(not connected[name .. "." .. (...)], "a port that is connected loses its connections")
      return done("mauve_released_by", name, ...)
    end,
    mauve_runs_as = function(_, ...) check(2, ...) return done("mauve_runs_as", name, ...) end,
    mauve_runs_on = function(_, ...) check(1, ...) return done("mauve_runs_on", name, ...) end,
    mauve_set = function(_, ...) check(2, ...) return done("mauve_set", name, ...) end,
    setCpuAffinity = function(_, ...) check(1, ...) return done("setCpuAffinity", name, ...) end,
    getProperty = function(_, ...)
      check(1, ...)
      local property = ...
      if failing == "getProperty " .. name .. "." .. property then
        error("No such property")
      end
      return closed({
        set = function(_, ...)
          check(1, ...)
          if not done("set", name, property, ...) then
            error("failed to assign")
          end
        end,
      })
    end,
  })
end

local deployer = closed({
  getName = function() return "Deployer" end,
  getPeer = function(_, name) return rawget(tasks, name) end,
  import = function(_, ...)
    check(1, ...)
    -- What is not found by its name is looked for below its target, where it is not either.
    if (...):match("^gnulinux/") then
      return false
    end
    imported[(...)] = true
    return done("import", ...)
  end,
  loadComponent = function(_, ...)
    check(2, ...)
    local name, class = ...
    assert(not rawget(tasks, name), "there is a task " .. name)
    assert(imported[class:match("^(.-)::[^:]+$")], "nothing is imported that has " .. class)
    tasks[name] = new_task(name)
    return done("load", ...)
  end,
  loadService = function(_, ...)
    check(2, ...)
    assert(rawget(tasks, (...)) and select(2, ...) == "marshalling", "no service")
    return done("loadService", ...)
  end,
  connect = function(_, ...)
    check(3, ...)
    local from, to, policy = ...
    of_task(from)
    of_task(to)
    connected[to] = true
    assert((policy.type == "DATA") == (policy.size == 0), "a policy of another size")
    return done("connect", from, to, policy.type, policy.size)
  end,
  connectOperations = function(_, ...)
    check(2, ...)
    of_task((...))
    of_task((select(2, ...)))
    return done("connectOperations", ...)
  end,
  setActivity = function(_, ...)
    check(4, ...)
    assert(rawget(tasks, (...)), "no task for an activity")
    active[(...)] = true
    return done("setActivity", ...)
  end,
  setMasterSlaveActivity = function(_, ...)
    check(2, ...)
    local master, slave = ...
    assert(active[master] and rawget(tasks, slave), "no master for an activity")
    slaves[slave] = master
    return done("setMasterSlaveActivity", ...)
  end,
  setWaitPeriodPolicy = function(_, ...)
    check(2, ...)
    assert(rawget(tasks, (...)), "no task for a policy")
    return done("setWaitPeriodPolicy", ...)
  end,
  stream = function(_, ...)
    check(2, ...)
    local port, topic = ...
    of_task(port)
    return done("stream", port, topic.topic)
  end,
})

rtt = closed({
  getTC = function() return deployer end,
  globals = closed({
    DATA = "DATA",
    CIRCULAR_BUFFER = "CIRCULAR_BUFFER",
    ORO_SCHED_RT = "ORO_SCHED_RT",
    ORO_SCHED_OTHER = "ORO_SCHED_OTHER",
    ORO_WAIT_REL = "ORO_WAIT_REL",
  }),
  Variable = function(name)
    assert(name == "ConnPolicy")
    return { type = "BUFFER", size = 0 }
  end,
  provides = function(name)
    assert(name == "ros" and imported.rtt_ros and imported.rtt_rosnode and imported.rtt_roscomm, "no ROS")
    return closed({
      provides = function(_, name)
        assert(name == "comm")
        return closed({ topic = function(_, topic) return { topic = topic } end })
      end,
    })
  end,
})
