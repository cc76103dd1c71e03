//! The command lines of `deploy`, run with the index variable of their platform.

use crate::end_to_end::util;
use crate::shared::run::Case;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

fn deploy(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("deploy")
        .join(name)
}

/// The strings of the list at `pointer` of a JSON file.
fn command(file: &str, pointer: &str) -> Vec<String> {
    let text = std::fs::read_to_string(deploy(file)).unwrap();
    let json: Value = serde_json::from_str(&text).unwrap();
    let list = json.pointer(pointer).unwrap().as_array().unwrap();
    list.iter()
        .map(|word| word.as_str().unwrap().to_owned())
        .collect()
}

/// Runs tasks with the command of a file, as the platform would with the index in `variable`.
fn runs(file: &str, pointer: &str, variable: &str, names: [&str; 3]) {
    let case = Case::new(&[]);
    case.plan(&["--shards", "5"]);
    let folder = tempfile::tempdir().unwrap();
    let shards = folder.path().join("shards");
    while case.advance() {
        let (status, said) = (case.status(), case.say("status", &["--missing"]));
        std::fs::write(&shards, &said.out).unwrap();
        for index in 0..status.missing().len() {
            let values = [
                case.scratch.display().to_string(),
                status.generation().to_string(),
                match file.contains("bucket") {
                    // Tasks that share no folder are given a list.
                    true => said.out.trim().replace('\n', ","),
                    false => shards.display().to_string(),
                },
            ];
            let put = |word: String| {
                let found = names.iter().position(|name| *name == word);
                found.map_or(word, |k| values[k].clone())
            };
            let words: Vec<String> = command(file, pointer).into_iter().map(put).collect();
            let words = words.iter().filter(|word| *word != "/outcrop");
            let mut task = util::program(words);
            let ended = task.env(variable, index.to_string()).output().unwrap();
            assert_eq!(ended.status.code(), Some(0), "{ended:?}");
        }
        assert_eq!(case.say("status", &["--missing"]).out, "");
    }
    case.check();
}

const NAMES: [&str; 3] = ["FOLDER", "GENERATION", "SHARDS"];

#[test]
fn kubernetes() {
    let pointer = "/spec/template/spec/containers/0/command";
    runs(
        "kubernetes/work.json",
        pointer,
        "JOB_COMPLETION_INDEX",
        NAMES,
    );
}

#[test]
fn aws_batch() {
    let names = ["Ref::folder", "Ref::generation", "Ref::shards"];
    let pointer = "/containerProperties/command";
    let file = "aws-batch/job-definition.json";
    runs(file, pointer, "AWS_BATCH_JOB_ARRAY_INDEX", names);
}

#[test]
fn google_batch() {
    let pointer = "/taskGroups/0/taskSpec/runnables/0/container/commands";
    runs("google-batch/job.json", pointer, "BATCH_TASK_INDEX", NAMES);
}

const LISTED: [&str; 3] = ["FOLDER", "GENERATION", "LIST"];

#[test]
fn kubernetes_with_a_bucket() {
    let pointer = "/spec/template/spec/containers/0/command";
    runs(
        "kubernetes/work-bucket.json",
        pointer,
        "JOB_COMPLETION_INDEX",
        LISTED,
    );
}

#[test]
fn aws_batch_with_a_bucket() {
    let names = ["Ref::folder", "Ref::generation", "Ref::shards"];
    let pointer = "/containerProperties/command";
    let file = "aws-batch/job-definition-bucket.json";
    runs(file, pointer, "AWS_BATCH_JOB_ARRAY_INDEX", names);
}

#[test]
fn google_batch_with_a_bucket() {
    let pointer = "/taskGroups/0/taskSpec/runnables/0/container/commands";
    let file = "google-batch/job-bucket.json";
    runs(file, pointer, "BATCH_TASK_INDEX", LISTED);
}

/// Runs `deploy/drive` with a command of `deploy`; `programs` stand for those of a platform.
fn drives(tasks: &str, programs: &[(&str, &str)]) {
    let python = Command::new("python3").arg("--version").output();
    if !programs.is_empty() && python.is_err() {
        let name = programs[0].0;
        util::skip(format_args!("there is no python3 to stand for {name}"));
        return;
    }
    let case = Case::new(&[]);
    case.plan(&["--shards", "3"]);
    let bin = tempfile::tempdir().unwrap();
    for (name, text) in programs {
        let path = bin.path().join(name);
        std::fs::write(&path, text).unwrap();
        let mode = std::os::unix::fs::PermissionsExt::from_mode(0o755);
        std::fs::set_permissions(&path, mode).unwrap();
    }
    let path = format!(
        "{}:{}",
        bin.path().display(),
        std::env::var("PATH").unwrap()
    );
    let ended = Command::new(deploy("drive"))
        .arg(&case.scratch)
        .arg(deploy(tasks))
        .arg(&case.scratch)
        .env("OUTCROP", env!("CARGO_BIN_EXE_outcrop"))
        .env("PATH", path)
        .envs([("QUEUE", "queue"), ("LOCATION", "europe-west1")])
        .output()
        .unwrap();
    assert_eq!(ended.status.code(), Some(0), "{ended:?}");
    case.check();
}

#[test]
fn xargs() {
    drives("xargs", &[]);
}

/// Runs the command of a Job that it is given, once for each index, one after another.
const KUBECTL: &str = r#"#!/usr/bin/env python3
import json, os, subprocess, sys
if sys.argv[1] == "get":
    print("Complete")
elif sys.argv[1] == "apply":
    spec = json.load(sys.stdin)["spec"]
    command = spec["template"]["spec"]["containers"][0]["command"]
    command[0] = os.environ["OUTCROP"]
    for index in range(spec["completions"]):
        subprocess.run(command, env=dict(os.environ, JOB_COMPLETION_INDEX=str(index)))
"#;

#[test]
fn an_indexed_job() {
    drives("kubernetes/run-tasks", &[("kubectl", KUBECTL)]);
}

/// Runs the job of a configuration that it is given, once for each index, one after another.
const GCLOUD: &str = r#"#!/usr/bin/env python3
import json, os, subprocess, sys
if sys.argv[3] == "describe":
    print("SUCCEEDED")
elif sys.argv[3] == "submit":
    group = json.load(sys.stdin)["taskGroups"][0]
    command = [os.environ["OUTCROP"]] + group["taskSpec"]["runnables"][0]["container"]["commands"]
    for index in range(int(group["taskCount"])):
        subprocess.run(command, env=dict(os.environ, BATCH_TASK_INDEX=str(index)))
"#;

#[test]
fn a_job_of_google_batch() {
    drives("google-batch/run-tasks", &[("gcloud", GCLOUD)]);
}

/// Runs the job definition with the parameters that it is given.
const AWS: &str = r#"#!/usr/bin/env python3
import json, os, subprocess, sys
given = dict(zip(sys.argv[3::2], sys.argv[4::2]))
if sys.argv[2] == "describe-jobs":
    print("SUCCEEDED")
    sys.exit()
parameters = json.loads(given["--parameters"])
definition = json.load(open(os.environ["DEFINITION"]))["containerProperties"]["command"]
put = lambda word: parameters[word[5:]] if word.startswith("Ref::") else word
command = [put(word) for word in definition]
if "--container-overrides" in given:
    command = json.loads(given["--container-overrides"])["command"]
    subprocess.run([os.environ["OUTCROP"]] + command)
else:
    for index in range(int(given["--array-properties"].split("=")[1])):
        env = dict(os.environ, AWS_BATCH_JOB_ARRAY_INDEX=str(index))
        subprocess.run([os.environ["OUTCROP"]] + command, env=env)
print("job")
"#;

#[test]
fn an_array_job_of_aws() {
    let definition = deploy("aws-batch/job-definition.json");
    let text = AWS.replace(
        "os.environ[\"DEFINITION\"]",
        &format!("{:?}", definition.display().to_string()),
    );
    drives("aws-batch/run-tasks", &[("aws", &text)]);
}
