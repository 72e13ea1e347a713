//! The classes of components: what their files say, and that all random models become code.

use std::path::PathBuf;

use expect_test::{Expect, expect};
use mauve_hir::{Database, Workspace, projects};
use mauve_orocos::packages;

/// The text of a component's file, of a model's only project.
fn generated(texts: Vec<(PathBuf, String)>, end: &str) -> Vec<(String, String)> {
    let db = Database::default();
    let workspace = Workspace::of_texts(&db, "/".into(), texts);
    let project = projects(&db, workspace)[0];
    let packages = packages(&db, project, None).unwrap();
    let files = packages.into_iter().flat_map(|package| package.files);
    let files = files.filter(|file| file.path.ends_with(end));
    files.map(|file| (file.path, file.text)).collect()
}

/// What stands in the file of a model's one component from a line that has `from` to an empty line.
fn shown(model: &str, end: &str, from: &[&str]) -> String {
    let texts = mauve_tests::fixture(model).into_iter().map(|(path, text)| (path.into(), text));
    let files = generated(texts.collect(), end);
    let [(_, text)] = files.as_slice() else { panic!("{files:?}") };
    let mut shown = String::new();
    for from in from {
        let begin = text.find(from).unwrap_or_else(|| panic!("no {from} in {text}"));
        let begin = text[..begin].rfind('\n').map_or(0, |line| line + 1);
        let rest = &text[begin..];
        shown += &rest[..rest.find("\n\n").map_or(rest.len(), |end| end + 1)];
    }
    shown
}

fn check(model: &str, end: &str, from: &[&str], expected: Expect) {
    expected.assert_eq(&shown(model, end, from));
}

/// The program `update` of a core with some of everything.
fn check_update(program: &str, expected: Expect) {
    let model = format!(
        "library lab {{
  codel count(in n: int): int
  codel tick(inout n: int): int
  codel two(in a: int, in b: int): int
  codel flag(): bool
  codel tell(in text: string, out other: string): void
  shell S {{
    property limit: double = 1
    input port goal: int
    output port next: double
    provide halt(): bool
  }}
  core C(S) {{
    var n: int = 1
    var m: int = 1
    var x: double = 0
    var f: float = 0
    var u: uint8 = 0
    var w: uint32 = 0
    var z: size_t = 0
    var b: bool = true
    var t: string = \"\"
    provide halt() = {{ n = 0; return b; }}
    update = {{ {program} }}
  }}
  component K(S, C)
}}"
    );
    let shown = shown(&model, "component.cpp", &["void K::update_program"]);
    let lines: Vec<&str> = shown.lines().collect();
    let lines: Vec<String> =
        lines[2..lines.len() - 1].iter().map(|line| format!("{}\n", &line[2..])).collect();
    expected.assert_eq(&lines.concat());
}

#[test]
fn a_state_machine_is_a_switch() {
    check(
        "library motion {
  codel look(): bool
  shell S { provide reset(): void }
  core C(S) {
    var seen: int = 3
    var gap: double
    provide reset() = { index = 0; }
    start = { return look(); }
    statemachine {
      var index: int = seen + 1
      initial state Waiting {
        entry = { seen = 0; }
        run = { }
        exit = { seen = 1; }
        transition go if look() to Moving { index = 2; }
        transition again if index > 3 to Waiting
        handle = { gap = 0; }
      }
      state Moving {
        transition done to Waiting
        transition never if (gap > 1) to Moving
      }
    }
  }
  component Walker(S, C)
}",
        "component.cpp",
        &["Walker::configureHook", "Walker::startHook", "Walker::updateHook", "guard_Waiting_again() {"],
        expect![[r#"
                bool Walker::configureHook() {
                  seen = 3;
                  gap = {};
                  return true;
                }
                bool Walker::startHook() {
                  if (!mauve_may_start()) return false;
                  index = seen + 1;
                  if (!start_program()) {
                    RTT::log(RTT::Error) << getName() << ": the program start returned false" << RTT::endlog();
                    return false;
                  }
                  current_state = State::Waiting;
                  entry_Waiting();
                  show_state();
                  mauve_started();
                  return true;
                }
                void Walker::updateHook() {
                  if (!mauve_begin()) return;
                  MAUVE_TRACE_COMPONENT(getName());
                  switch (current_state) {
                    case State::Waiting:
                      run_Waiting();
                      if (guard_Waiting_go()) {
                        exit_Waiting();
                        effect_Waiting_go();
                        current_state = State::Moving;
                      } else if (guard_Waiting_again()) {
                        exit_Waiting();
                        current_state = State::Waiting;
                        entry_Waiting();
                      } else {
                        handle_Waiting();
                      }
                      break;
                    case State::Moving:
                      current_state = State::Waiting;
                      entry_Waiting();
                      // transition never is never taken: model.mal:21
                      break;
                  }
                  show_state();
                  mauve_end();
                }
                bool Walker::guard_Waiting_again() {
                  MAUVE_TRACE_PROGRAM(getName(), "motion.Walker", "Waiting", "again", "guard");
                  return index > 3;
                }
            "#]],
    );
}

#[test]
fn a_shell_is_checked_and_frozen() {
    let model = "library motion {
  shell Base { property name: string = \"arm\" + \"_1\" }
  shell S extends Base {
    // In metres.
    property gap: double [0; 2 * width] = 0.5
    property led: uint8 [0; 7] = 3
    constant width: double = 0.38 + 0.1
    property class: string
    input port scan: LaserScan
    output port to: float
  }
  core C(S) {
    var echoes: LaserScan
    var spare: int
    update = { if (read(scan, echoes) == new_data && status(scan) != no_data) then { write(to, 0.1); } else { } }
  }
  component K(S, C)
  use sensor_msgs
}";
    check(
        model,
        "component.hpp",
        &["class K", " protected", "shell S", "core C"],
        expect![[r#"
                class K : public MauveTask {
                 public:
                  explicit K(const std::string& name_);
                 protected:
                  bool configureHook() override;
                  bool startHook() override;
                  void updateHook() override;
                  void stopHook() override;
                  // shell S: model.mal:3
                  // property gap: double [0; 2 * width]: model.mal:5
                  double gap = 0.5;
                  // property led: uint8 [0; 7]: model.mal:6
                  std::uint8_t led = 3;
                  // constant width: double: model.mal:7
                  double width_property = 0.48;
                  double width = 0.48;  // the value that configureHook() found
                  // property class: string: model.mal:8
                  std::string class_{};
                  // input port scan: LaserScan: model.mal:9
                  RTT::InputPort<::sensor_msgs::LaserScan> scan;
                  RTT::FlowStatus scan_status = RTT::NoData;  // of the last read
                  // output port to: float: model.mal:10
                  RTT::OutputPort<float> to;
                  // core C: model.mal:12
                  ::sensor_msgs::LaserScan echoes{};  // model.mal:13
                  // spare: unused, model.mal:14
            "#]],
    );
    let from = ["K::K(", "K::configureHook", "K::update_program"];
    check(
        model,
        "component.cpp",
        &from,
        expect![[r#"
            K::K(const std::string& name_)
                : MauveTask(name_) {
              addProperty("name", name).doc("property name: string");
              addProperty("gap", gap).doc("property gap: double [0; 2 * width]");
              addProperty("led", led).doc("property led: uint8 [0; 7]");
              addProperty("width", width_property).doc("constant width: double");
              addProperty("class", class_).doc("property class: string");
              addPort("scan", scan).doc("input port scan: LaserScan");
              addPort("to_", to).doc("output port to: float");
              addOperation("mauve_set", &K::mauve_set, this, RTT::ClientThread)
                  .doc("Sets properties of types that scripts cannot set.").arg("property", "")
                  .arg("text", "a whole number");
              mauve_add_period_port("period");
            }
            bool K::configureHook() {
              // property gap: double [0; 2 * width]: model.mal:5
              if (!(gap >= 0.0 && gap <= 2 * width_property)) {
                RTT::log(RTT::Error) << getName() << ": property gap is " << gap << ", and must be in [0; "
                                     << 2 * width_property << "]" << RTT::endlog();
                return false;
              }
              // property led: uint8 [0; 7]: model.mal:6
              if (!(led <= 7)) {
                RTT::log(RTT::Error) << getName() << ": property led is " << static_cast<int>(led)
                                     << ", and must be in [0; 7]" << RTT::endlog();
                return false;
              }
              // Constants keep their present values from here on.
              width = width_property;
              scan_status = RTT::NoData;
              echoes = {};
              return true;
            }
            void K::update_program() {
              MAUVE_TRACE_PROGRAM(getName(), "motion.K", "", "", "update");
              if ((scan_status = MAUVE_TRACE_READ(getName(), "motion.K.scan", scan, echoes)) == RTT::NewData &&
                  scan_status != RTT::NoData) {
                MAUVE_TRACE_WRITE(getName(), "motion.K.to", to, 0.1f);
              }
            }
        "#]],
    );
}

#[test]
fn operations_are_provided_sent_and_collected() {
    let model = "library motion {
  shell S {
    require plan(in goal: int, out cost: double, inout way: string): int
    require land(): void
    provide reset(in hard: bool, in text: string, out was: int): bool
  }
  core C(S) {
    var n: int = 1
    var x: double = 0
    var t: string = \"\"
    handler planning: plan
    handler landing: land
    provide reset(in hard: bool, in text: string, out was: int) = { was = n; t = text; return true; }
    update = {
      planning = send(plan, n, t);
      send(plan, n + 1, t);
      landing = send(land);
      if (collect(planning, n, x, t) == success) then { reset(true, t, n); }
      else if (collect(planning) != failure) then { n = 1; } else { }
    }
  }
  component K(S, C)
}";
    let header = ["// shell S", "// core C", "// The results of", "// Calls with", "  bool is_planning"];
    check(
        model,
        "component.hpp",
        &header,
        expect![[r#"
                  // shell S: model.mal:2
                  // require plan(in goal: int, out cost: double, inout way: string): int: model.mal:3
                  RTT::OperationCaller<int(int, double&, std::string&)> plan;
                  // require land(): void: model.mal:4
                  RTT::OperationCaller<void()> land;
                  // core C: model.mal:7
                  int n = 1;                                                  // model.mal:8
                  double x = 0.0;                                             // model.mal:9
                  std::string t = "";                                         // model.mal:10
                  RTT::SendHandle<int(int, double&, std::string&)> planning;  // model.mal:11
                  RTT::SendHandle<void()> landing;                            // model.mal:12
                  // The results of operations that were sent, until they are collected.
                  double planning_cost{};
                  std::string planning_way{};
                  double plan_cost{};
                  std::string plan_way{};
                  // Calls with inout arguments: the next call is sent only after the last one has ended.
                  RTT::SendHandle<int(int, double&, std::string&)> planning_last_call;
                  RTT::SendHandle<int(int, double&, std::string&)> plan_last_call;
                  bool is_planning_under_way();
                  bool is_plan_under_way();
                  void update_program();
                  bool reset(bool /*hard*/, std::string text, int& was);
                  bool call_reset(bool hard, std::string text, int& was);
                };
            "#]],
    );
    let source = ["K::K(", "K::configureHook", "K::is_plan_under_way", "K::update_program", "K::reset(bool"];
    check(
        model,
        "component.cpp",
        &source,
        expect![[r#"
                K::K(const std::string& name)
                    : MauveTask(name),
                      plan("plan"),
                      land("land") {
                  this->requires()->addOperationCaller(plan);
                  this->requires()->addOperationCaller(land);
                  addOperation("reset", &K::call_reset, this, RTT::OwnThread)
                      .doc("provide reset(in hard: bool, in text: string, out was: int): bool")
                      .arg("hard", "in bool").arg("text", "in string").arg("was", "out int");
                  mauve_add_period_port("period");
                }
                bool K::configureHook() {
                  n = 1;
                  x = 0.0;
                  t = "";
                  planning = decltype(planning)();
                  landing = decltype(landing)();
                  return true;
                }
                bool K::is_plan_under_way() {
                  int dropped{};
                  double dropped_2{};
                  std::string dropped_3{};
                  return mauve_collect(plan_last_call, dropped, dropped_2, dropped_3) == RTT::SendNotReady;
                }
                void K::update_program() {
                  MAUVE_TRACE_PROGRAM(getName(), "motion.K", "", "", "update");
                  if (!is_planning_under_way()) {
                    planning_way = t;
                    planning_last_call = planning = mauve_send(plan, n, planning_cost, planning_way);
                  }
                  if (!is_plan_under_way()) {
                    plan_way = t;
                    plan_last_call = mauve_send(plan, n + 1, plan_cost, plan_way);
                  }
                  landing = mauve_send(land);
                  if (mauve_collect(planning, n, x, t) == RTT::SendSuccess) {
                    const auto t_before = t;
                    reset(true, t_before, n);
                  } else {
                    int dropped{};
                    double dropped_2{};
                    std::string dropped_3{};
                    if (mauve_collect(planning, dropped, dropped_2, dropped_3) > RTT::SendFailure) {
                      n = 1;
                    }
                  }
                }
                bool K::reset(bool /*hard*/, std::string text, int& was) {
                  MAUVE_TRACE_PROGRAM(getName(), "motion.K", "", "reset", "operation");
                  was = n;
                  t = text;
                  return true;
                }
            "#]],
    );
}

#[test]
fn what_is_left_to_cpp_is_evaluated_from_left_to_right() {
    check_update(
        "n = two(count(1), count(2));",
        expect![[r#"
            const auto count_result = MAUVE_TRACE_CODEL(getName(), "lab.count", ::lab::count(1));
            const auto count_result_2 = MAUVE_TRACE_CODEL(getName(), "lab.count", ::lab::count(2));
            n = MAUVE_TRACE_CODEL(getName(), "lab.two", ::lab::two(count_result, count_result_2));
        "#]],
    );
    check_update(
        "n = n + tick(n);",
        expect![[r#"
            const auto n_before = n;
            n = n_before + MAUVE_TRACE_CODEL(getName(), "lab.tick", ::lab::tick(n));
        "#]],
    );
    check_update(
        "n = tick(n) + n;",
        expect![[r#"
            const auto tick_result = MAUVE_TRACE_CODEL(getName(), "lab.tick", ::lab::tick(n));
            n = tick_result + n;
        "#]],
    );
    check_update(
        "n = m + tick(n);",
        expect![[r#"
            n = m + MAUVE_TRACE_CODEL(getName(), "lab.tick", ::lab::tick(n));
        "#]],
    );
    check_update(
        "b = halt() == (n < 3);",
        expect![[r#"
            const auto halt_result = halt();
            b = halt_result == (n < 3);
        "#]],
    );
    check_update(
        "b = read(goal, n) == status(goal);",
        expect![[r#"
            const auto read_result = (goal_status = MAUVE_TRACE_READ(getName(), "lab.K.goal", goal, n));
            b = read_result == goal_status;
        "#]],
    );
    check_update(
        "tell(t, t); tell(t + t, t);",
        expect![[r#"
            const auto t_before = t;
            MAUVE_TRACE_CODEL(getName(), "lab.tell", ::lab::tell(t_before, t));
            MAUVE_TRACE_CODEL(getName(), "lab.tell", ::lab::tell(t + t, t));
        "#]],
    );
    check_update(
        "b = b && two(count(1), count(2)) > 3 && n > 1 || flag();",
        expect![[r#"
            bool both = b;
            if (both) {
              const auto count_result = MAUVE_TRACE_CODEL(getName(), "lab.count", ::lab::count(1));
              const auto count_result_2 = MAUVE_TRACE_CODEL(getName(), "lab.count", ::lab::count(2));
              both = MAUVE_TRACE_CODEL(getName(), "lab.two", ::lab::two(count_result, count_result_2)) > 3;
            }
            b = (both && n > 1) || MAUVE_TRACE_CODEL(getName(), "lab.flag", ::lab::flag());
        "#]],
    );
    check_update(
        "if b then { n = 1; } else if (two(count(1), n) > 3) then { n = 2; } else if b then { n = 3; } else { }",
        expect![[r#"
                if (b) {
                  n = 1;
                } else {
                  const auto count_result = MAUVE_TRACE_CODEL(getName(), "lab.count", ::lab::count(1));
                  if (MAUVE_TRACE_CODEL(getName(), "lab.two", ::lab::two(count_result, n)) > 3) {
                    n = 2;
                  } else if (b) {
                    n = 3;
                  }
                }
            "#]],
    );
}

#[test]
fn numbers_are_those_of_the_model() {
    check_update(
        "n = 010; n = -2147483648; n = 0x1F; x = 3; x = 1e21; x = 7 / 2; f = 0.1; z = 3;",
        expect![[r#"
            n = 10;
            n = std::numeric_limits<int>::min();
            n = 31;
            x = 3.0;
            x = 1e21;
            x = 7 / 2;
            f = 0.1f;
            z = 3u;
        "#]],
    );
    check_update(
        "f = f * 0.5 + 1; f = n; f = f * (1.0 / 3.0); x = x * 2 + n; u = u + 1; u = -u;",
        expect![[r#"
            f = f * 0.5f + 1.0f;
            f = static_cast<float>(n);
            f = f * static_cast<float>(1.0 / 3.0);
            x = x * 2.0 + n;
            u = static_cast<std::uint8_t>(u + 1);
            u = static_cast<std::uint8_t>(-u);
        "#]],
    );
    check_update(
        "b = w < n; b = w < 3; b = z > n; b = u > n; b = n * 2 < x;",
        expect![[r#"
            b = static_cast<std::int64_t>(w) < static_cast<std::int64_t>(n);
            b = w < 3u;
            b = n < 0 || z > static_cast<std::uint64_t>(n);
            b = u > n;
            b = n * 2 < x;
        "#]],
    );
    check_update(
        "n = n - (n - 1) - -n; x = -(-x); b = (n < 3) == b; b = !b == b; b = b || b && !(n < 3);",
        expect![[r#"
            n = n - (n - 1) - -n;
            x = -(-x);
            b = (n < 3) == b;
            b = (!b) == b;
            b = b || (b && !(n < 3));
        "#]],
    );
    check_update(
        "t = \"a\" + t; b = \"a\" == \"b\"; t = t;",
        expect![[r#"
            t = std::string("a") + t;
            b = std::string("a") == "b";
            static_cast<void>(t);
        "#]],
    );
}

#[test]
fn names_hide_what_they_hide_in_the_model() {
    check_update(
        "var n: int = n + 1; { var n: int = n; m = n; { var State: string = t; t = State; } } var x: int; x = n; write(next, limit);",
        expect![[r#"
            int n_ = n + 1;
            {
              int n_0_ = n_;
              m = n_0_;
              {
                std::string State = t;
                t = State;
              }
            }
            int x_{};
            static_cast<void>(x_);
            x_ = n_;
            MAUVE_TRACE_WRITE(getName(), "lab.K.next", next, limit);
        "#]],
    );
}

#[test]
fn variables_of_the_machine_hide_no_codel_outside_of_it() {
    check(
        "library l {
  codel go(): int
  shell S { provide ask(): int }
  core C(S) {
    var n: int = 0;
    provide ask(): int = { return go(); }
    statemachine { var go: int = 3; initial state A { run = { n = go; } } }
  }
  component K(S, C)
}",
        "component.cpp",
        &["int K::ask", "K::run_A"],
        expect![[r#"
                int K::ask() {
                  MAUVE_TRACE_PROGRAM(getName(), "l.K", "", "ask", "operation");
                  return MAUVE_TRACE_CODEL(getName(), "l.go", ::l::go());
                }
                void K::run_A() {
                  MAUVE_TRACE_PROGRAM(getName(), "l.K", "A", "", "run");
                  n = go;
                }
            "#]],
    );
}

#[test]
fn what_is_always_true_is_no_warning() {
    let model = "library l { shell S { } core C(S) { var n: int = 1  var b: bool = true  update = { b = CONDITION; } } component K(S, C) }";
    for (condition, is_obvious) in [
        ("n == n", true),
        ("n + 1 == 1 + n", true),
        ("n >= -2147483648", true),
        ("n > 3 && n < 2", true),
        ("n < 3 || n > 2", true),
        ("b || !b", true),
        ("n > 2 && n < 5", false),
        ("n == 1 || n == 2", false),
        ("n > 3 && b", false),
    ] {
        let texts = vec![("/model.mal".into(), model.replace("CONDITION", condition))];
        let files = generated(texts, "component.cpp");
        assert_eq!(files[0].1.contains("#pragma GCC diagnostic ignored"), is_obvious, "{condition}");
    }
}

/// All of a text but its literals and comments.
fn code_of(text: &str) -> String {
    let mut code = String::new();
    for line in text.lines() {
        let mut in_literal = false;
        let line = line.replace("\\\\", "").replace("\\\"", "");
        for (index, part) in line.split('"').enumerate() {
            in_literal = index % 2 == 1;
            if !in_literal {
                code += part.split("//").next().unwrap();
            }
            if !in_literal && part.contains("//") {
                break;
            }
        }
        assert!(!in_literal || line.contains("//"), "{line}");
        code.push('\n');
    }
    code
}

#[test]
fn every_model_becomes_code() {
    let random = mauve_tests::search::seeds("MAUVE_MODELS", 150).map(|seed| {
        let files = mauve_tests::random_model(seed).written().files;
        files.into_iter().map(|(path, text)| (path.into(), text)).collect()
    });
    let mut sample: Vec<(PathBuf, String)> = Vec::new();
    let mut open = vec![mauve_tests::models().join("p3dx")];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|it| it == "mal" || it == "toml") {
                let text = std::fs::read_to_string(&path).unwrap();
                sample.push((
                    PathBuf::from("/").join(path.strip_prefix(mauve_tests::models().join("p3dx")).unwrap()),
                    text,
                ));
            }
        }
    }
    for texts in random.chain([sample]) {
        for (path, text) in
            ["component.hpp", "component.cpp"].into_iter().flat_map(|end| generated(texts.clone(), end))
        {
            let code = code_of(&text);
            // What has no meaning would be a `{}`: only variables are that, where hooks give them their first values.
            let at = code.find("::updateHook()").unwrap_or_default();
            let (hooks, programs) = code.split_at(at);
            for (open, close) in [('(', ')'), ('{', '}'), ('[', ']')] {
                let count = |c: char| code.matches(c).count();
                assert_eq!(count(open), count(close), "{path}\n{text}");
            }
            assert!(text.lines().all(|line| line.chars().count() <= 100), "{path}\n{text}");
            assert!(
                !code.contains("void*")
                    && !hooks.replace("= {};\n", "").contains("= {}")
                    && !programs.contains("= {}")
                    && !code.contains("({})"),
                "{path}\n{text}"
            );
            assert!(
                !text.contains(" \n") && !text.contains("\n\n\n") && !text.contains("{\n\n}"),
                "{path}\n{text}"
            );
        }
    }
}
