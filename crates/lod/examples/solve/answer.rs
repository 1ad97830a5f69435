//! From worked cases to answers, as JSON values: the format at both ends, and which function answers which policy.
//!
//! In: the case file. Out: one answer for every policy that a case expects. Never here: a policy; the crate has them.

use metachron_lod::grisoni::{Gains, GrisoniLaw, Limits};
use metachron_lod::select::gobbetti;
use metachron_lod::select::gobbetti::Mesh;
use metachron_lod::select::incremental;
use metachron_lod::select::incremental::Keep;
use metachron_lod::select::robin_hood;
use metachron_lod::select::robin_hood::{Instance, TooLittle};
use metachron_lod::select::tree::{Cut, Node, Tree};
use metachron_lod::select::{
    Entry, Level, Mode, Problem, Selection, exact, funkhouser, linear, marginal, mason, mason_flat, rates, tree_exact,
};
use serde_json::{Map, Value, json};

/// Answers kept on the way to an optimum, at most: some gigabytes before it gives up.
const STATES_MAX: usize = 50_000_000;

/// The format of case files that is read.
const FORMAT: i64 = 1;

/// One answer for every policy of every case, in the order of the file.
pub fn answers(file: &Value) -> Result<Vec<Value>, String> {
    if file["format"] != FORMAT {
        return Err(format!("format is {}; {FORMAT} is read", file["format"]));
    }
    let cases = list(file, "cases")?;
    let mut all = Vec::new();
    for case in cases {
        let id = case["id"].as_str().unwrap_or("?");
        all.extend(answers_of(case).map_err(|why| format!("case {id}: {why}"))?);
    }
    Ok(all)
}

fn answers_of(case: &Value) -> Result<Vec<Value>, String> {
    let one = |fields: Value| vec![labelled(case, "main", fields)];
    match case["kind"].as_str().unwrap_or("none") {
        "mckp" => knapsack(case),
        "tree" => tree(case),
        "robinhood" => Ok(one(robin_hood(case)?)),
        "gobbetti" => Ok(one(gobbetti(case)?)),
        "rates" => Ok(one(rates_of(case)?)),
        "grisoni" => Ok(one(grisoni(case)?)),
        other => Err(format!("no such kind: {other}")),
    }
}

fn labelled(case: &Value, policy: &str, fields: Value) -> Value {
    let mut answer = Map::new();
    answer.insert("id".to_owned(), case["id"].clone());
    answer.insert("policy".to_owned(), json!(policy));
    answer.extend(fields.as_object().cloned().unwrap_or_default());
    Value::Object(answer)
}

/// The policies that a case names; `main` alone where it names none.
fn policies(case: &Value) -> Vec<String> {
    let expect = case["expect"].as_object();
    let names = expect.into_iter().flat_map(Map::keys).filter(|k| *k != "feasible");
    let names: Vec<_> = names.cloned().collect();
    if names.is_empty() { vec!["main".to_owned()] } else { names }
}

fn knapsack(case: &Value) -> Result<Vec<Value>, String> {
    let mode = if case["mode"] == "exactly_one" { Mode::ExactlyOne } else { Mode::AtMostOne };
    let objects: Result<Vec<_>, String> = list(case, "objects")?.iter().map(entries).collect();
    let (objects, budget) = (objects?, integer(case, "budget")?);
    // the crate draws nothing of an object without levels; one level of everything is then more than there is
    let impossible = mode == Mode::ExactlyOne && objects.iter().any(Vec::is_empty);
    let mut problem = Problem::new(mode, if impossible { 0 } else { budget });
    for (id, levels) in (0..).zip(&objects) {
        problem.push(id, levels);
    }
    let answer = |policy: &String| {
        let mut fields = by_policy(&problem, policy)?;
        if impossible {
            fields["feasible"] = json!(false);
        }
        Ok(labelled(case, policy, fields))
    };
    policies(case).iter().map(answer).collect()
}

fn by_policy(problem: &Problem, policy: &str) -> Result<Value, String> {
    let chosen = match policy {
        "lp" => {
            let bound = linear(problem);
            return Ok(
                json!({"feasible": bound.is_some(), "value": bound.map(|b| b.value), "lambda": bound.map(|b| b.lambda)}),
            );
        }
        "opt" | "main" => exact(problem, STATES_MAX).map_err(|e| format!("{} states are too many", e.states))?,
        "fs_skip" => funkhouser::greedy(problem, funkhouser::Scan::Skip),
        "fs_stop" => funkhouser::greedy(problem, funkhouser::Scan::Stop),
        "fs_incr" => incremental::incremental(problem, &[], Keep::Last).selection,
        "marg_stop" => marginal::marginal(problem, marginal::Fit::Stop),
        "marg_fill" => marginal::marginal(problem, marginal::Fit::Fill),
        "best_single" => marginal::best_single(problem),
        other => return Err(format!("no such policy: {other}")),
    };
    Ok(selection(&chosen))
}

fn selection(s: &Selection) -> Value {
    let choice: Vec<_> = s.levels.iter().map(|l| index(*l)).collect();
    json!({"feasible": s.feasible, "value": s.value, "cost": s.cost, "choice": choice, "upper": s.upper})
}

fn index(level: Level) -> i64 {
    level.map_or(-1, i64::from)
}

fn tree(case: &Value) -> Result<Vec<Value>, String> {
    let node = |n: &Value| {
        let parent = usize::try_from(integer(n, "parent")?).ok();
        Ok(Node { parent, impostors: entries(&n["impostors"])? })
    };
    let nodes: Result<Vec<_>, String> = list(case, "nodes")?.iter().map(node).collect();
    let tree = Tree::new(integer(case, "budget")?, &nodes?).map_err(|e| e.to_string())?;
    policies(case).iter().map(|policy| Ok(labelled(case, policy, by_tree_policy(&tree, policy)?))).collect()
}

fn by_tree_policy(tree: &Tree, policy: &str) -> Result<Value, String> {
    let chosen = match policy {
        "lp" => {
            let best = tree_exact::lagrange(tree);
            return Ok(json!({"feasible": best.feasible, "value": best.feasible.then_some(best.upper)}));
        }
        "opt" | "main" => {
            tree_exact::exact(tree, STATES_MAX).map_err(|e| format!("{} states are too many", e.states))?
        }
        "lagrange" => tree_exact::lagrange(tree),
        "mb_incr" => mason::incremental(tree, &[], Keep::Last).cut,
        "mb_best" => mason::incremental(tree, &[], Keep::Best).cut,
        "mb_skip" => mason_flat::flat(tree),
        other => return Err(format!("no such policy: {other}")),
    };
    Ok(cut(&chosen))
}

fn cut(c: &Cut) -> Value {
    let drawn = c.levels.iter().enumerate().filter_map(|(node, l)| Some((node.to_string(), json!((*l)?))));
    json!({"feasible": c.feasible, "value": c.value, "cost": c.cost, "cut": drawn.collect::<Map<_, _>>(), "upper": c.upper})
}

fn robin_hood(case: &Value) -> Result<Value, String> {
    let instance = |(id, i): (u64, &Value)| {
        let forms: Result<Vec<_>, _> = list(i, "lods")?.iter().map(real).collect();
        Ok(Instance {
            id,
            complexity: number(i, "complexity")?,
            value: number(i, "value")?,
            forms: forms?,
            too_little: TooLittle::Nothing,
        })
    };
    let instances: Result<Vec<_>, String> = (0..).zip(list(case, "instances")?).map(instance).collect();
    let d = robin_hood::distribute(number(case, "t_r")?, &instances?);
    let forms: Vec<_> = d.form.iter().map(|f| index(*f)).collect();
    Ok(json!({"feasible": true, "order": d.order, "alloc": d.offered, "lod": forms, "leftover": d.leftover}))
}

fn gobbetti(case: &Value) -> Result<Value, String> {
    let mesh = |o: &Value| {
        Ok(Mesh { weight: number(o, "w")?, time: number(o, "a")?, least: number(o, "lo")?, most: number(o, "hi")? })
    };
    let meshes: Result<Vec<_>, String> = list(case, "objects")?.iter().map(mesh).collect();
    let best = gobbetti::closed_form(number(case, "time")?, number(case, "fixed")?, &meshes?);
    Ok(json!({"feasible": best.feasible, "r": best.r, "value": best.value, "lambda": best.lambda}))
}

fn rates_of(case: &Value) -> Result<Value, String> {
    let agent = |o: &Value| {
        let (least_hz, most_hz) = (number(o, "lo")?, number(o, "hi")?);
        Ok(rates::Agent { weight: number(o, "w")?, step_s: number(o, "c")?, least_hz, most_hz })
    };
    let agents: Result<Vec<_>, String> = list(case, "objects")?.iter().map(agent).collect();
    let best = rates::rates(number(case, "util")?, &agents?);
    Ok(
        json!({"feasible": best.feasible, "f": best.f_hz, "value": best.error, "cost": best.error, "lambda": best.lambda}),
    )
}

/// The law over the declared plant f = 1 / (c0 + c1 (length/ε) (k0 + k1 2ⁿ)).
fn grisoni(case: &Value) -> Result<Value, String> {
    let gains = Gains { alpha: number(case, "alpha")?, beta: number(case, "beta")? };
    let n = |key| integer(case, key).map(|n| n.clamp(0, 255) as u8);
    let limits = Limits { eps: (number(case, "eps_lo")?, number(case, "eps_hi")?), n: (n("n_lo")?, n("n_hi")?) };
    let mut law = GrisoniLaw::new(gains, limits, number(case, "eps0")?, number(case, "rho0")?);
    let plant = |key| number(&case["plant"], key);
    let (c0, c1, length, k0, k1) = (plant("c0")?, plant("c1")?, plant("length")?, plant("k0")?, plant("k1")?);
    let (f0, steps, every) = (number(case, "f0")?, integer(case, "steps")?, integer(&case["expect"], "every")?);
    let mut trace = Vec::new();
    for step in 0..steps {
        let polygons = k0 + k1 * f64::exp2(f64::from(law.n()));
        let f = 1.0 / (c0 + c1 * (length / law.eps()) * polygons);
        if step % every.max(1) == 0 {
            trace.push(json!([law.eps(), law.rho(), law.n(), f]));
        }
        law.observe(f0, f);
    }
    Ok(json!({"feasible": true, "trace": trace}))
}

fn entries(levels: &Value) -> Result<Vec<Entry>, String> {
    let entry = |pair: &Value| match (pair[0].as_u64(), pair[1].as_u64()) {
        (Some(cost), Some(benefit)) => Ok(Entry::new(cost, benefit)),
        _ => Err(format!("not a cost and a benefit: {pair}")),
    };
    levels.as_array().ok_or_else(|| format!("not a list: {levels}"))?.iter().map(entry).collect()
}

fn list<'a>(of: &'a Value, key: &str) -> Result<&'a Vec<Value>, String> {
    of[key].as_array().ok_or_else(|| format!("{key} is not a list"))
}

fn integer(of: &Value, key: &str) -> Result<i64, String> {
    of[key].as_i64().ok_or_else(|| format!("{key} is not a whole number: {}", of[key]))
}

fn number(of: &Value, key: &str) -> Result<f64, String> {
    real(&of[key]).map_err(|why| format!("{key}: {why}"))
}

fn real(value: &Value) -> Result<f64, String> {
    value.as_f64().ok_or_else(|| format!("not a number: {value}"))
}
