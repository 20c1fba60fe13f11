//! A batch on a cluster: a job array of Slurm, whose tasks each run `riprap batch PLAN --only K-L`, and a job behind it that
//! writes the table; or the same commands a line a task, for PBS, LSF and GNU parallel.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::error::{Error, Result};

use super::plan::Plan;

/// By this a batch runs again what is finished.
const FORCE: &str = " --force";

/// The words that run these members of a plan, or another part of the batch; `force` stands behind its options. `program` is the
/// riprap to run on the cluster, unless the plan says how it is started there.
fn command(plan: &Plan, program: &Path, force: &str, what: &str) -> String {
    let own = || quoted(&program.to_string_lossy());
    format!(
        "{} batch {} --out {} --threads {}{force} {what}",
        plan.slurm.program.clone().unwrap_or_else(own),
        quoted(&absolute(&plan.file).to_string_lossy()),
        quoted(&absolute(&plan.out).to_string_lossy()),
        plan.threads,
    )
}

/// The script of the array. With `force`, a task that its node lost must not run again what it had done: one that starts again goes on
/// without it, and one of several members, some of whose files may be old ones yet, does not start again.
pub fn script(plan: &Plan, program: &Path, jobs: Option<usize>, force: bool) -> String {
    // Without a number the cluster says how many run at a time.
    let at_a_time = jobs.map_or(String::new(), |jobs| format!("%{jobs}"));
    let each = plan.slurm.members_per_task.max(1);
    let tasks = plan.members.len().div_ceil(each).max(1);
    let mut lines = head(plan, "", "slurm-%A_%a.log");
    lines.push(format!("#SBATCH --array=0-{}{at_a_time}", tasks - 1));
    lines.push(format!("#SBATCH --cpus-per-task={}", plan.threads));
    // Ctrl-C's signal two minutes before the time is up: the run ends cleanly.
    lines.push("#SBATCH --signal=B:INT@120".to_string());
    // A task that its node lost starts again, and goes on where its run was.
    let requeue = if force && each > 1 { "--no-requeue" } else { "--requeue" };
    lines.push(format!("#SBATCH {requeue}"));
    lines.push("#SBATCH --open-mode=append".to_string());
    if let Some(memory) = &plan.slurm.memory {
        lines.push(format!("#SBATCH --mem={memory}"));
    }
    lines.push(String::new());
    lines.extend(setup_of(plan));
    if each > 1 {
        lines.push(format!("first=$((SLURM_ARRAY_TASK_ID * {each}))"));
        lines.push(format!("last=$((first + {}))", each - 1));
    }
    lines.push(
        "# exec: the signal reaches riprap itself. An array submitted again skips what is finished.".into(),
    );
    let members = if each > 1 { "\"$first-$last\"" } else { "\"$SLURM_ARRAY_TASK_ID\"" };
    let exec = |force: &str| format!("exec {}", command(plan, program, force, &format!("--only {members}")));
    if force && each == 1 {
        lines.push("# Started again, it goes on with what it had begun to run again.".into());
        lines.push(format!("[ \"${{SLURM_RESTART_COUNT:-0}}\" -gt 0 ] && {}", exec("")));
    }
    lines.push(exec(if force { FORCE } else { "" }));
    lines.join("\n") + "\n"
}

/// The script of the job that writes the table when the array is done.
pub fn summary_script(plan: &Plan, program: &Path) -> String {
    let mut lines = head(plan, "-summary", "slurm-%j-summary.log");
    lines.push(String::new());
    lines.extend(setup_of(plan));
    lines.push(format!("exec {}", command(plan, program, "", "--summary")));
    lines.join("\n") + "\n"
}

/// The plan's lines of setup. Where one fails nothing is run.
fn setup_of(plan: &Plan) -> impl Iterator<Item = String> + '_ {
    let stops = (!plan.slurm.setup.is_empty()).then(|| "set -e".to_string());
    stops.into_iter().chain(plan.slurm.setup.iter().cloned())
}

/// What both scripts tell Slurm.
fn head(plan: &Plan, ending: &str, log: &str) -> Vec<String> {
    let name = plan.file.file_stem().unwrap_or(plan.file.as_os_str()).to_string_lossy().into_owned();
    let mut lines = vec![
        // Not sh: clusters put `module` into bash.
        "#!/bin/bash".to_string(),
        format!("#SBATCH --job-name=riprap-{}{ending}", super::safe(&name)),
        "#SBATCH --ntasks=1".to_string(),
        format!("#SBATCH --output={}", quoted(&absolute(&plan.out).join(log).to_string_lossy())),
    ];
    for (option, value) in [("time", &plan.slurm.time), ("partition", &plan.slurm.partition)] {
        if let Some(value) = value {
            lines.push(format!("#SBATCH --{option}={value}"));
        }
    }
    lines.extend(plan.slurm.options.iter().map(|option| format!("#SBATCH {option}")));
    lines
}

/// Name of the file of the plan's lines of setup: in a line of commands a comment would swallow what comes behind it.
const SETUP: &str = "setup.sh";

/// The commands of all members, a line for those of a task.
fn commands(plan: &Plan, program: &Path, force: bool) -> String {
    let force = if force { FORCE } else { "" };
    let setup = match plan.slurm.setup.is_empty() {
        true => String::new(),
        false => format!(". {}; ", quoted(&absolute(&plan.out).join(SETUP).to_string_lossy())),
    };
    let (all, each) = (plan.members.len(), plan.slurm.members_per_task.max(1));
    let line = |first: usize| {
        let last = (first + each).min(all) - 1;
        let members = if last > first { format!("{first}-{last}") } else { first.to_string() };
        format!("{setup}{}\n", command(plan, program, force, &format!("--only {members}")))
    };
    (0..all).step_by(each).map(line).collect()
}

/// Writes the commands of all members beside the results, those of a task in a line, behind the plan's setup: `parallel -j 4 < commands.txt`, or
/// line N in task N of an array of PBS or LSF.
///
/// # Errors
/// A file that cannot be written.
pub fn write_commands(plan: &Plan, program: &Path, force: bool) -> Result<PathBuf> {
    if !plan.slurm.setup.is_empty() {
        write(plan, SETUP, &(setup_of(plan).collect::<Vec<_>>().join("\n") + "\n"))?;
    }
    write(plan, "commands.txt", &commands(plan, program, force))
}

fn write(plan: &Plan, name: &str, text: &str) -> Result<PathBuf> {
    std::fs::create_dir_all(&plan.out).map_err(|e| Error::io("create", &plan.out, e))?;
    let path = plan.out.join(name);
    std::fs::write(&path, text).map_err(|e| Error::io("write", &path, e))?;
    Ok(path)
}

/// Writes the scripts beside the results and hands them to `sbatch` where there is one, the table's to run behind the array: the
/// array's script and what was submitted, if it was.
///
/// # Errors
/// A script that cannot be written; an sbatch that refuses.
pub fn submit(
    plan: &Plan,
    program: &Path,
    jobs: Option<usize>,
    force: bool,
) -> Result<(PathBuf, Option<String>)> {
    let array = write(plan, "array.sh", &script(plan, program, jobs, force))?;
    let summary = write(plan, "summary.sh", &summary_script(plan, program))?;
    let Some(first) = sbatch(&array, &[])? else { return Ok((array, None)) };
    let behind = format!("--dependency=afterany:{first}");
    let second = sbatch(&summary, &[&behind])?.unwrap_or_default();
    Ok((array, Some(format!("submitted job {first}; job {second} writes the table behind it"))))
}

/// Submits a script: the job's number; `None` where there is no sbatch.
fn sbatch(script: &Path, options: &[&str]) -> Result<Option<String>> {
    match Command::new("sbatch").arg("--parsable").args(options).arg(script).output() {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(e) => Err(Error::io("start", Path::new("sbatch"), e)),
        // Number, and behind a semicolon the cluster.
        Ok(output) if output.status.success() => {
            let said = String::from_utf8_lossy(&output.stdout).trim().to_string();
            Ok(Some(said.split(';').next().unwrap_or_default().to_string()))
        }
        Ok(output) => {
            let said = String::from_utf8_lossy(&output.stderr).trim().to_string();
            Err(Error::Usage(format!("sbatch refused {}: {said}", script.display())))
        }
    }
}

fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf())
}

/// For a shell, whatever the text is.
fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=%".contains(c);
    match !text.is_empty() && text.chars().all(plain) {
        true => text.to_string(),
        false => format!("'{}'", text.replace('\'', "'\\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::super::Member;
    use super::super::cluster::Slurm;
    use super::*;

    #[test]
    fn commands_have_the_members_of_a_task_and_the_setup_before_them() {
        let folder = tempfile::tempdir().expect("a folder");
        let plan = |members_per_task: usize, setup: &[&str]| Plan {
            file: "/x/plan.json".into(),
            members: ["a", "b", "c"].map(|name| Member::sample(name, folder.path())).to_vec(),
            out: folder.path().join("it's out"),
            jobs: None,
            threads: 2,
            slurm: Slurm {
                members_per_task,
                setup: setup.iter().map(|line| line.to_string()).collect(),
                ..Slurm::default()
            },
        };
        let written = |plan: &Plan, force: bool| {
            let path = write_commands(plan, Path::new("/bin/riprap"), force).expect("written");
            std::fs::read_to_string(path).expect("the commands")
        };
        let single = written(&plan(0, &[]), false);
        let ends = |text: &str| -> Vec<String> {
            text.lines().map(|line| line.rsplit("--threads 2 ").next().unwrap_or_default().into()).collect()
        };
        assert_eq!(ends(&single), ["--only 0", "--only 1", "--only 2"]);
        assert!(
            single.lines().all(|line| line.starts_with("/bin/riprap batch /x/plan.json --out ")),
            "{single}"
        );
        let pairs = plan(2, &["module load gcc # as it was built", "export A=1"]);
        let both = written(&pairs, true);
        assert_eq!(ends(&both), ["--force --only 0-1", "--force --only 2"]);
        let setup = pairs.out.join(SETUP);
        let begin = format!(". {}; /bin/riprap batch ", quoted(&setup.to_string_lossy()));
        assert!(both.lines().all(|line| line.starts_with(&begin)), "{both}");
        let lines = std::fs::read_to_string(setup).expect("the setup");
        assert_eq!(lines, "set -e\nmodule load gcc # as it was built\nexport A=1\n");
    }

    /// As GNU parallel runs a line of the commands, and Slurm a script.
    #[cfg(unix)]
    #[test]
    fn nothing_is_run_behind_a_setup_that_fails() {
        let folder = tempfile::tempdir().expect("a folder");
        for (setup, runs) in [("false", false), ("true", true)] {
            let plan = Plan {
                file: "/x/plan.json".into(),
                members: vec![Member::sample("a", folder.path())],
                out: folder.path().join(setup),
                jobs: None,
                threads: 1,
                slurm: Slurm {
                    setup: vec![setup.into(), "true".into()],
                    program: Some("echo ran".into()),
                    ..Slurm::default()
                },
            };
            let program = Path::new("/bin/riprap");
            let commands = write_commands(&plan, program, false).expect("written");
            let line = std::fs::read_to_string(commands).expect("the commands");
            for text in [line, script(&plan, program, None, false), summary_script(&plan, program)] {
                let output = Command::new("bash").args(["-c", &text]).output().expect("a shell");
                assert_eq!(String::from_utf8_lossy(&output.stdout).contains("ran batch"), runs, "{text}");
                assert_eq!(output.status.success(), runs, "{text}");
            }
        }
    }

    #[test]
    fn the_array_has_a_task_for_each_member() {
        let member = Member {
            name: "a".into(),
            case: "a.json".into(),
            overrides: Vec::new(),
            completed: serde_json::Value::Null,
            results: "a.h5".into(),
        };
        let plan = Plan {
            file: "/x/it's.json".into(),
            members: vec![member.clone(), member.clone(), member],
            out: "/x/out".into(),
            jobs: None,
            threads: 4,
            slurm: Slurm {
                time: Some("1:00".into()),
                options: vec!["--account=a".into()],
                ..Slurm::default()
            },
        };
        assert!(script(&plan, Path::new("/bin/riprap"), None, false).contains("--array=0-2\n"));
        let script = script(&plan, Path::new("/bin/riprap"), Some(2), true);
        for part in [
            "--array=0-2%2\n",
            "--cpus-per-task=4\n",
            "#SBATCH --time=1:00\n",
            "#SBATCH --account=a\n",
            "#SBATCH --requeue\n",
            "[ \"${SLURM_RESTART_COUNT:-0}\" -gt 0 ] && exec /bin/riprap batch '/x/it'\\''s.json' --out /x/out --threads 4 --only \"$SLURM_ARRAY_TASK_ID\"\n",
            "\nexec /bin/riprap batch '/x/it'\\''s.json' --out /x/out --threads 4 --force --only \"$SLURM_ARRAY_TASK_ID\"\n",
        ] {
            assert!(script.contains(part), "{script}\nhas no {part}");
        }
        // The array may be submitted from anywhere.
        let plan = Plan { out: "out".into(), ..plan };
        let folder = absolute(Path::new("out"));
        let log = format!("#SBATCH --output={}/slurm-%A_%a.log\n", quoted(&folder.to_string_lossy()));
        assert!(
            self::script(&plan, Path::new("/bin/riprap"), None, false).contains(&log) && folder.is_absolute()
        );
        let (_, behind) = script.split_once("\nexec ").unwrap_or_default();
        assert!(!behind.contains("#SBATCH"), "Slurm reads options up to the first command");
        // Several members a task, and how riprap is started there.
        let slurm = Slurm {
            members_per_task: 2,
            setup: vec!["module load x".into()],
            program: Some("run.sif riprap".into()),
            ..plan.slurm.clone()
        };
        let plan = Plan { slurm, out: "/x/out".into(), ..plan };
        let script = self::script(&plan, Path::new("/bin/riprap"), None, false);
        for part in [
            "--array=0-1\n",
            "\n\nset -e\nmodule load x\nfirst=$((SLURM_ARRAY_TASK_ID * 2))\nlast=$((first + 1))\n",
            "\nexec run.sif riprap batch ",
            " --only \"$first-$last\"\n",
        ] {
            assert!(script.contains(part), "{script}\nhas no {part}");
        }
        assert!(script.contains("#SBATCH --requeue\n") && !script.contains("RESTART_COUNT"), "{script}");
        let forced = self::script(&plan, Path::new("/bin/riprap"), None, true);
        assert!(forced.contains("#SBATCH --no-requeue\n") && forced.contains(" --force --only"), "{forced}");
        assert!(summary_script(&plan, Path::new("/bin/riprap")).ends_with(" --threads 4 --summary\n"));
    }
}
