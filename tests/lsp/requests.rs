//! Commands, and the requests that are ours alone, through the binary.

use mauve_tests::{Client, mauve, models};
use serde_json::{Value, json};

use super::{MAUVE, robot};

fn set_significance(client: &mut Client, arguments: Value) -> Result<Value, String> {
    let params = json!({"command": "mauve.setSignificance", "arguments": arguments});
    let answer = client.call("workspace/executeCommand", params);
    answer.map_err(|error| error["message"].as_str().unwrap().to_owned())
}

#[test]
fn another_level_is_shown_everywhere_until_it_is_taken_back() {
    let mut client = robot();
    let text = client.open_file(&models().join("p3dx/deployment.mal"));
    assert!(client.hint(&text, "activity navigation").contains("! 997 / 1000 ms"));
    assert_eq!(client.codes(&text), [] as [&str; 0]);
    assert_eq!(set_significance(&mut client, json!([1e-5])), Ok(json!(1e-5)));
    // What is asked from here on is of that level, and what was shown is to be asked for again.
    assert!(client.hint(&text, "activity navigation").starts_with("✗ CPU 1 overloaded"));
    assert_eq!(client.codes(&text), ["deadline-missed"]);
    client.wait("a refresh", |message| message["method"] == "workspace/inlayHint/refresh");
    let hover = client.call("textDocument/hover", text.at("navigation  {")).unwrap();
    assert!(hover["contents"]["value"].as_str().unwrap().contains("at 1e-5"), "{hover}");
    // As text too; null takes it back.
    assert_eq!(set_significance(&mut client, json!(["1e-3"])), Ok(json!(1e-3)));
    assert_eq!(set_significance(&mut client, json!([null])), Ok(Value::Null));
    assert!(client.hint(&text, "activity navigation").contains("! 997 / 1000 ms"));
    client.wait_for_published(|published| published.is_empty());
}

#[test]
fn a_level_that_is_none_is_refused_and_changes_nothing() {
    let mut client = robot();
    let text = client.open_file(&models().join("p3dx/deployment.mal"));
    for arguments in [
        json!([0]),
        json!([-1e-4]),
        json!([1]),
        json!(["NaN"]),
        json!(["inf"]),
        json!(["often"]),
        json!([]),
        json!([1e-4, 1e-5]),
        json!([{"level": 1e-4}]),
    ] {
        let error = set_significance(&mut client, arguments.clone()).unwrap_err();
        assert!(error.starts_with("mauve.setSignificance takes one level"), "{arguments}: {error}");
    }
    let error = set_significance(&mut client, json!([3e-4])).unwrap_err();
    assert!(error.starts_with("no times at 3e-4: the tables have 1e-3, 1e-4"), "{error}");
    assert!(client.hint(&text, "activity navigation").contains("! 997 / 1000 ms"));
}

#[test]
fn unknown_commands_are_refused() {
    let mut client = robot();
    let error = client.call("workspace/executeCommand", json!({"command": "mauve.fly"})).unwrap_err();
    assert_eq!(error["code"], -32602);
    assert_eq!(
        error["message"],
        "no command `mauve.fly`: there are mauve.setSignificance, mauve.generateOrocos, mauve.reload"
    );
}

#[test]
fn the_analysis_is_what_the_command_line_prints() {
    let mut client = robot();
    let text = client.open_file(&models().join("p3dx/deployment.mal"));
    let folder = models().join("p3dx");
    let printed = |arguments: &[&str]| -> Value {
        let all = [&["wcrt", ".", "--format", "json"], arguments].concat();
        serde_json::from_str(&mauve(MAUVE, &folder, &all).out).unwrap()
    };
    let document = json!({"uri": text.uri});
    let found = client.call("mauve/analysis", json!({})).unwrap();
    assert_eq!(found, json!([printed(&[])]));
    let params = json!({
        "textDocument": document, "deployment": "P3dxDeployment", "significance": "all", "method": "classic",
    });
    let found = client.call("mauve/analysis", params).unwrap();
    assert_eq!(found, json!([printed(&["--significance", "all", "--method", "classic"])]));
    let found = client.call("mauve/analysis", json!({"significance": [1e-3, 1e-5]})).unwrap();
    assert_eq!(found, json!([printed(&["--significance", "1e-3,1e-5"])]));
    // The level that was chosen is the one that is left out.
    set_significance(&mut client, json!([1e-6])).unwrap();
    let found = client.call("mauve/analysis", json!({"textDocument": document})).unwrap();
    assert_eq!(found, json!([printed(&["--significance", "1e-6"])]));
}

#[test]
fn an_analysis_that_cannot_be_is_refused() {
    let mut client = robot();
    for (params, message) in [
        (json!({"deployment": "Nowhere"}), "no deployment `Nowhere`"),
        (json!({"significance": 2}), "expected a significance between 0 and 1"),
        (json!({"significance": []}), ""),
        (json!({"significance": "some"}), ""),
        (json!({"method": "magic"}), ""),
        (json!({"textDocument": {"uri": "file:///nowhere.mal"}}), "`file:///nowhere.mal` is neither open"),
    ] {
        let answer = client.call("mauve/analysis", params.clone());
        match answer {
            Err(error) => {
                assert_eq!(error["code"], -32602, "{params}: {error}");
                assert!(error["message"].as_str().unwrap().contains(message), "{params}: {error}");
            }
            // No level is none too many.
            Ok(found) => assert_eq!(found[0]["results"], json!([]), "{params}"),
        }
    }
}

#[test]
fn a_state_machine_has_its_times_and_its_places() {
    let mut client = robot();
    let text = client.open_file(&models().join("p3dx/deployment.mal"));
    let at = text.at("navigation  {");
    let found = client.call("mauve/stateMachine", at.clone()).unwrap();
    assert_eq!(found["component"], "Navigation");
    let times = found["edges"].as_array().unwrap().iter().map(|edge| edge["time"].as_f64().unwrap());
    assert_eq!(times.fold(0.0, f64::max), 297.0);
    let states = found["states"].as_array().unwrap();
    let planning = states.iter().find(|state| state["name"] == "Planning").unwrap();
    // The place is that of the name, in another file.
    let uri = planning["location"]["uri"].as_str().unwrap();
    let source = std::fs::read_to_string(uri.strip_prefix("file://").unwrap()).unwrap();
    let start = &planning["location"]["range"]["start"];
    let line = source.lines().nth(start["line"].as_u64().unwrap() as usize).unwrap();
    assert!(line[start["character"].as_u64().unwrap() as usize..].starts_with("Planning"), "{line}");
    assert!(found["drawing"].as_str().unwrap().starts_with("<svg "));
    // By its name, at another level, for Graphviz.
    let params = json!({
        "textDocument": at["textDocument"], "component": "P3dxDriver", "significance": 1e-9, "drawing": "dot",
    });
    let found = client.call("mauve/stateMachine", params);
    let found = found.unwrap_or_else(|error| panic!("{error}"));
    assert!(found["drawing"].as_str().unwrap().starts_with("digraph "));
    assert_eq!((&found["times"], &found["otherTimes"]), (&json!(null), &json!([])));
    let params = json!({"textDocument": at["textDocument"], "component": "P3dxDriver", "deployment": "Sea"});
    let error = client.call("mauve/stateMachine", params).unwrap_err();
    assert_eq!(error["message"], "no deployment `Sea` in this project");
    let params = json!({"textDocument": at["textDocument"], "component": "Nobody"});
    let error = client.call("mauve/stateMachine", params).unwrap_err();
    assert_eq!(error["message"], "no component `Nobody` in the project of this file");
    let error = client.call("mauve/stateMachine", json!({"textDocument": at["textDocument"]})).unwrap_err();
    assert_eq!(error["message"], "mauve/stateMachine takes a `position` or a `component`");
}

#[test]
fn a_graph_has_what_is_connected_and_what_is_known_of_it() {
    let mut client = robot();
    let text = client.open_file(&models().join("p3dx/deployment.mal"));
    let document = json!({"uri": text.uri});
    let graphs = client.call("mauve/graph", json!({"textDocument": document})).unwrap();
    assert_eq!(graphs.as_array().unwrap().len(), 1);
    let found = &graphs[0];
    assert_eq!(found["root"], json!(models().join("p3dx/exploration.mal")));
    assert_eq!((&found["name"], &found["significance"]), (&json!("P3dxDeployment"), &json!(1e-4)));
    let nodes = found["nodes"].as_array().unwrap();
    let number = |name: &str| nodes.iter().position(|node| node["instance"] == name).unwrap();
    let navigation = &nodes[number("navigation")];
    assert_eq!((&navigation["response"], &navigation["status"]), (&json!(997), &json!("met")));
    let is_link = |edge: &&Value| {
        edge["source"] == number("guidance")
            && edge["target"] == number("switch")
            && edge["operation"] == false
    };
    assert!(found["edges"].as_array().unwrap().iter().any(|edge| is_link(&edge)), "{}", found["edges"]);
    let drawing = found["drawing"].as_str().unwrap();
    assert!(
        drawing.contains("! 997 / 1000 ms") && drawing.contains("data-place=\"navigation_architecture.mal:"),
        "{drawing}"
    );
    let text = client.call("mauve/graph", json!({"textDocument": document, "drawing": "text"})).unwrap();
    assert!(text[0]["drawing"].as_str().unwrap().contains("│ navigation: Navigation"), "{text}");
    let params = json!({"textDocument": document, "name": "ExplorationP3dxArchitecture", "drawing": "dot"});
    let found = &client.call("mauve/graph", params).unwrap()[0];
    assert_eq!((&found["significance"], &found["nodes"][0]["status"]), (&Value::Null, &Value::Null));
    let error = client.call("mauve/graph", json!({"textDocument": document, "name": "Nothing"})).unwrap_err();
    assert!(
        error["message"].as_str().unwrap().contains("no deployment or architecture `Nothing`"),
        "{error}"
    );
}

#[test]
fn a_schedule_is_that_behind_a_response_time() {
    let mut client = robot();
    let text = client.open_file(&models().join("p3dx/deployment.mal"));
    let document = json!({"uri": text.uri});
    // Without an instance, the one with the least slack.
    let found = client.call("mauve/schedule", json!({"textDocument": document})).unwrap();
    assert_eq!((&found["deployment"], &found["instance"]), (&json!("P3dxDeployment"), &json!("navigation")));
    assert_eq!((&found["bound"], &found["response"]), (&json!(997), &json!(997)));
    assert_eq!(found["note"], "job 1 of navigation: ! 997 / 1000 ms, which is its bound");
    let instances = found["instances"].as_array().unwrap();
    // What is not analysed is named, too: it may be the one that is asked for.
    let exploration = instances.iter().find(|it| it["instance"] == "exploration").unwrap();
    assert_eq!((&exploration["response"], instances.len()), (&Value::Null, 10));
    let drawing = found["drawing"].as_str().unwrap();
    assert!(drawing.starts_with("<svg "));
    for instant in [">release 0 ms<", ">deadline 1000 ms<", ">end 997 ms<"] {
        assert!(drawing.contains(instant), "{instant} in {drawing}");
    }
    let narrow = json!({"textDocument": document, "drawing": "narrow"});
    let narrow = client.call("mauve/schedule", narrow).unwrap();
    assert!(
        narrow["drawing"].as_str().unwrap().starts_with("<svg ") && narrow["drawing"] != found["drawing"]
    );
    // The numbers in the drawing are those of the activities.
    let hokuyo =
        found["activities"].as_array().unwrap().iter().find(|it| it["instance"] == "hokuyo").unwrap();
    let drawn = format!("data-activity=\"{}\"><title>hokuyo, job 1", hokuyo["index"]);
    assert!(found["drawing"].as_str().unwrap().contains(&drawn), "{drawn}");
    // At a position, as text, and by name.
    let mut params = text.at("activity teleop");
    params["drawing"] = json!("text");
    let found = client.call("mauve/schedule", params).unwrap();
    assert_eq!((&found["instance"], &found["bound"]), (&json!("teleop"), &json!(70)));
    assert!(found["drawing"].as_str().unwrap().contains("█ executes"), "{found}");
    let params = json!({"textDocument": document, "instance": "exploration"});
    let found = client.call("mauve/schedule", params).unwrap();
    assert_eq!(found["drawing"], Value::Null);
    assert_eq!(found["reasons"][0], "`exploration` has no response time in P3dxDeployment");
    let params = json!({"textDocument": document, "instance": "missing"});
    let error = client.call("mauve/schedule", params).unwrap_err();
    assert_eq!(error["message"], "no activity `missing` in P3dxDeployment");
}

#[test]
fn the_probability_of_a_late_job_follows_the_text() {
    let mut client = robot();
    let mut text = client.open_file(&models().join("p3dx/deployment.mal"));
    let params = json!({"textDocument": {"uri": text.uri}});
    // Without an instance, the one with the greatest probability.
    let found = client.call("mauve/probability", params).unwrap();
    assert_eq!((&found["instance"], &found["reasons"]), (&json!("guidance"), &json!([])));
    assert_eq!(found["instances"].as_array().unwrap().len(), 9);
    assert!(found["drawing"].as_str().unwrap().starts_with("<svg "));
    let of_hokuyo = |client: &mut Client, mut params: Value| {
        params["drawing"] = json!("text");
        let found = client.call("mauve/probability", params).unwrap();
        assert_eq!(found["instance"], "hokuyo");
        found["drawing"].as_str().unwrap().to_owned()
    };
    let drawing = of_hokuyo(&mut client, text.at("activity hokuyo"));
    assert!(
        drawing.starts_with("hokuyo of P3dxDeployment: late at most 1.5e-4 times an hour\n"),
        "{drawing}"
    );
    assert!(drawing.contains("    1e-9  no bound, longer in an hour with at most 7.2e-5\n"), "{drawing}");
    // It takes 58 ms at 1e-6, and 63 ms at 1e-7.
    client.edit(
        &mut text,
        "priority = 9   period = 100   deadline = 100",
        "priority = 9   period = 100   deadline = 60",
    );
    let drawing = of_hokuyo(&mut client, text.at("activity hokuyo"));
    assert!(
        drawing.starts_with("hokuyo of P3dxDeployment: late at most 1.3e-2 times an hour\n"),
        "{drawing}"
    );
}

#[test]
fn chains_of_a_deployment_follow_the_text() {
    let mut client = robot();
    let mut config = client.open_file(&models().join("p3dx/mauve.toml"));
    let mut params = json!({"textDocument": {"uri": config.uri}});
    let assumed = "while = [\"guidance.Steering\", \"switch.Automatic\"]\n";
    client.edit(&mut config, assumed, "");
    let found = client.call("mauve/chains", params.clone()).unwrap();
    assert_eq!(found["hops"], json!([]));
    let first = &found["chains"][0];
    assert_eq!(
        (&first["latency"], &first["status"], &first["figure"]),
        (&Value::Null, &json!("unknown"), &json!("? no bound"))
    );
    assert!(!first["reasons"].as_array().unwrap().is_empty(), "{first}");

    client.edit(&mut config, "latency = \"600 ms\"\n", assumed);
    params["deployment"] = json!("P3dxDeployment");
    params["drawing"] = json!("text");
    let found = client.call("mauve/chains", params.clone()).unwrap();
    let avoid = &found["chains"][0];
    assert_eq!(
        (&avoid["name"], &avoid["figure"], &avoid["status"]),
        (&json!("avoid"), &json!("≤ 526 ms"), &json!("time"))
    );
    assert_eq!((&avoid["location"]["uri"], &avoid["reasons"]), (&json!(config.uri), &json!([])));
    let hops = found["hops"].as_array().unwrap();
    let instances: Vec<&Value> = hops.iter().map(|it| &it["instance"]).collect();
    assert_eq!(instances, ["hokuyo", "guidance", "switch", "p3dx_driver"]);
    let times = ["wait", "buffer", "periods", "run"]
        .map(|part| hops.iter().map(|it| it[part].as_f64().unwrap()).sum::<f64>());
    assert_eq!(times.iter().sum::<f64>(), 526.0);
    // A component is shown where data comes to it.
    let of_guidance = hops[1]["location"]["uri"].as_str().unwrap();
    assert!(of_guidance.ends_with("exploration_architecture.mal"), "{of_guidance}");
    assert!(found["drawing"].as_str().unwrap().contains("avoid: ≤ 526 ms"), "{found}");

    // The chain is lit in the graph.
    let graph = &client
        .call("mauve/graph", json!({"textDocument": {"uri": config.uri}, "chain": "avoid"}))
        .unwrap()[0];
    let lit = graph["nodes"].as_array().unwrap().iter().filter(|it| it["lit"] == true);
    assert_eq!(lit.count(), 4);
    params["deployment"] = json!("Nothing");
    let error = client.call("mauve/chains", params).unwrap_err();
    assert!(
        error["message"].as_str().unwrap().contains("no deployment or architecture `Nothing`"),
        "{error}"
    );
}

#[test]
fn the_budget_of_the_cpus_of_a_deployment() {
    let mut client = robot();
    let text = client.open_file(&models().join("p3dx/deployment.mal"));
    let found = client.call("mauve/cpuBudget", json!({"textDocument": {"uri": text.uri}})).unwrap();
    let first = &found["cpus"][0];
    assert_eq!(
        (&first["status"], &first["figure"]),
        (&json!("tight"), &json!("! CPU 1: 99.4 % used, 0.6 % left"))
    );
    assert_eq!(
        first["parts"][0],
        json!({"name": "hokuyo", "instance": true, "share": 0.43, "figure": "✓ 53 / 100 ms"})
    );
    assert!(found["drawing"].as_str().unwrap().starts_with("<svg "), "{found}");
}

#[test]
fn what_if_compares_with_the_state_of_the_first_answer() {
    let mut client = robot();
    let mut text = client.open_file(&models().join("p3dx/deployment.mal"));
    let mut params = json!({"textDocument": {"uri": text.uri}});
    let found = client.call("mauve/whatIf", params.clone()).unwrap();
    assert_eq!(
        (&found["deployment"], &found["verdict"]),
        (&json!("P3dxDeployment"), &json!("9 of 9 deadlines met, as before"))
    );
    assert_eq!((&found["edit"], &found["reasons"]), (&Value::Null, &json!([])));
    assert!(found["drawing"].as_str().unwrap().starts_with("<svg "));
    params["before"] = found["before"].clone();

    // Values that are not in the text.
    params["values"] = json!(["hokuyo.deadline=50", "teleop.period=200"]);
    let found = client.call("mauve/whatIf", params.clone()).unwrap();
    assert_eq!(
        (&found["verdict"], &found["schedulable"]),
        (&json!("9 → 8 of 9 deadlines met"), &json!(false))
    );
    let first = found["rows"].as_array().unwrap().iter().find(|it| it["name"] == "hokuyo").unwrap();
    let figures = (&first["name"], &first["figure"], &first["change"], &first["status"]);
    assert_eq!(
        figures,
        (&json!("hokuyo"), &json!("✓ 53 / 100 → ✗ 53 / 50 ms"), &json!("missed"), &json!("missed"))
    );
    assert_eq!(first["location"]["uri"], json!(text.uri));
    assert!(found["drawing"].as_str().unwrap().contains("data-row=\"1\"><title>hokuyo: "), "{found}");
    let edits = found["edit"].to_string();
    assert!(edits.contains("\"newText\":\"50\"") && edits.contains("\"newText\":\"200\""), "{edits}");

    // The same in the text: the state before stays.
    params["values"] = json!([]);
    params["drawing"] = json!("text");
    client.edit(
        &mut text,
        "priority = 9   period = 100   deadline = 100",
        "priority = 9   period = 100   deadline = 50",
    );
    let found = client.call("mauve/whatIf", params.clone()).unwrap();
    assert_eq!(
        (&found["verdict"], &found["before"]),
        (&json!("9 → 8 of 9 deadlines met"), &params["before"])
    );
    let drawing = found["drawing"].as_str().unwrap();
    assert!(drawing.contains("✓ 53 / 100 → ✗ 53 / 50 ms") && drawing.contains("no longer met"), "{drawing}");

    for (values, before, message) in [
        ("hokuyo.period=fast", None, "hokuyo.period=fast"),
        ("hokuyo.perod=5", None, "did you mean `hokuyo.period`?"),
        ("hokuyo.period=200", Some("{}"), "`before` is not that of an answer"),
    ] {
        params["values"] = json!([values]);
        params["before"] = json!(before);
        let error = client.call("mauve/whatIf", params.clone()).unwrap_err();
        assert!(error["message"].as_str().unwrap().contains(message), "{error}");
    }
}

#[test]
fn execution_times_of_a_codel_at_all_levels() {
    let mut client = robot();
    let text = client.open_file(&models().join("p3dx/deployment.mal"));
    let document = json!({"uri": text.uri});
    let params = json!({"textDocument": document, "codel": "missing"});
    let error = client.call("mauve/executionTimes", params).unwrap_err();
    assert_eq!(error["message"], "no codel `missing` in the project of this file");
    let error = client.call("mauve/executionTimes", json!({"textDocument": document})).unwrap_err();
    assert_eq!(error["message"], "mauve/executionTimes takes a `position`, a `codel` or an `instance`");
    let error = client.call("mauve/executionTimes", text.at("deployment P3dx")).unwrap_err();
    assert_eq!(error["message"], "no codel here");
    let codel = codel_of(&mut client, &document);
    let params = json!({"textDocument": document, "codel": codel});
    let found = client.call("mauve/executionTimes", params).unwrap();
    assert_eq!(found["codel"], codel);
    let levels = found["levels"].as_array().unwrap();
    assert!(levels.len() > 1, "{found}");
    // A smaller probability needs a longer time.
    let of = |it: &Value| (it["significance"].as_f64().unwrap(), it["times"][0].as_f64().unwrap());
    assert!(levels.iter().map(of).is_sorted_by(|a, b| a.0 > b.0 && a.1 <= b.1), "{levels:?}");
    // A longer time may be too long for a deadline.
    let at = |significance: f64| {
        let level = levels.iter().find(|it| it["significance"] == significance).unwrap();
        (level["verdict"]["status"].as_str().unwrap(), level["verdict"]["text"].as_str().unwrap())
    };
    assert!(at(1e-4).0 == "tight" && at(1e-9).0 == "missed", "{levels:?}");
    let params = json!({"textDocument": document, "codel": "astar"});
    let limit = &client.call("mauve/executionTimes", params).unwrap()["limit"];
    assert_eq!(*limit, json!({"status": "tight", "text": "! ≤ 296 ms"}));
    assert!(found["drawing"].as_str().unwrap().starts_with("<svg "));
    // At its declaration.
    let uri = found["location"]["uri"].as_str().unwrap().to_owned();
    let params = json!({"textDocument": {"uri": uri}, "position": found["location"]["range"]["start"]});
    assert_eq!(client.call("mauve/executionTimes", params).unwrap()["codel"], codel);
}

#[test]
fn codels_of_an_activity_are_compared() {
    let mut client = robot();
    let text = client.open_file(&models().join("p3dx/deployment.mal"));
    let params = json!({"textDocument": {"uri": text.uri}, "instance": "missing"});
    let error = client.call("mauve/executionTimes", params).unwrap_err();
    assert_eq!(error["message"], "no activity `missing` with codels in the project of this file");
    let params = json!({"textDocument": {"uri": text.uri}, "instance": "hokuyo"});
    let found = client.call("mauve/executionTimes", params).unwrap();
    // From the timing table, the longest one first.
    let codels =
        ["hokuyo_sweep", "hokuyo_rearm", "drop_veils", "mask_robot"].map(|it| format!("drivers.{it}"));
    assert_eq!(found["compared"], json!(codels));
    assert_eq!(found["levels"][1]["times"], json!([41, 1.5, 1.3, 0.7]));
    assert_eq!((&found["codel"], &found["instance"]), (&Value::Null, &json!("hokuyo")));
    assert!(found["instances"].as_array().unwrap().contains(&json!("hokuyo")));
    // At its activity.
    assert_eq!(client.call("mauve/executionTimes", text.at("activity hokuyo")).unwrap(), found);
}

/// The name of a codel of the robot that the timing tables have.
fn codel_of(client: &mut Client, document: &Value) -> String {
    let params = json!({"textDocument": document, "codel": "aria_drive"});
    let found = client.call("mauve/executionTimes", params);
    let found = found.unwrap_or_else(|error| panic!("{error}"));
    found["codel"].as_str().unwrap().to_owned()
}

#[test]
fn each_project_of_a_file_has_its_graphs() {
    let folder = mauve_tests::scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_requests_graphs");
    let root = |name: &str| {
        format!(
            "include \"lib.mal\"\narchitecture {name} {{ import Base }}\ndeployment D {{ architecture {name} }}\n"
        )
    };
    let (a, b) = (root("A"), root("B"));
    mauve_tests::write(
        &folder,
        &[
            ("a.mal", &a),
            ("b.mal", &b),
            ("lib.mal", "architecture Base { }\n"),
            ("mauve.toml", "[project]\nroots = [\"a.mal\", \"b.mal\"]\n[timing]\ntables = \"t.toml\"\n"),
            ("t.toml", ""),
        ],
    );
    let mut client = Client::of_folder(MAUVE, &folder);
    let mut graphs = |file: &str| {
        let document = json!({"uri": format!("file://{}", folder.join(file).display())});
        let found = client.call("mauve/graph", json!({"textDocument": document})).unwrap();
        let shown = |it: &Value| {
            let root = std::path::Path::new(it["root"].as_str().unwrap());
            format!("{} of {}", it["name"].as_str().unwrap(), root.file_name().unwrap().display())
        };
        found.as_array().unwrap().iter().map(shown).collect::<Vec<_>>()
    };
    assert_eq!(graphs("lib.mal"), ["Base of a.mal"]);
    assert_eq!(graphs("b.mal"), ["D of b.mal"]);
    assert_eq!(graphs("t.toml"), ["D of a.mal", "D of b.mal"]);
    assert_eq!(graphs("mauve.toml"), ["D of a.mal", "D of b.mal"]);
}

#[test]
fn a_syntax_tree_is_that_of_the_text_as_it_is() {
    let mut client = robot();
    let mut text = client.open_file(&models().join("p3dx/deployment.mal"));
    client.edit(&mut text, "deployment P3dxDeployment", "deployment");
    let tree = client.call("mauve/syntaxTree", json!({"textDocument": {"uri": text.uri}})).unwrap();
    assert_eq!(tree, json!(mauve_syntax_dump(&text.text)));
    let uri = format!("file://{}", models().join("p3dx/mauve.toml").display());
    let error = client.call("mauve/syntaxTree", json!({"textDocument": {"uri": uri}})).unwrap_err();
    assert!(error["message"].as_str().unwrap().ends_with("mauve.toml` is not a model (*.mal)"), "{error}");
}

/// What `mauve parse` prints of a text.
fn mauve_syntax_dump(text: &str) -> String {
    let folder = mauve_tests::scratch(env!("CARGO_TARGET_TMPDIR"), "lsp_requests_tree");
    mauve_tests::write(&folder, &[("a.mal", text)]);
    mauve(MAUVE, &folder, &["parse", "a.mal"]).out
}
