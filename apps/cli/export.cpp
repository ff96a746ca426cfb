// traceur export: a learned motion for a real robot's servos, or for another program.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/cli/arguments.h"
#include "apps/cli/csv.h"
#include "apps/cli/output.h"
#include "apps/cli/performance.h"
#include "apps/cli/verbs.h"
#include "traceur/control/expression.h"
#include "traceur/core/error.h"
#include "traceur/core/pending_file.h"
#include "traceur/core/printable.h"
#include "traceur/core/toml.h"
#include "traceur/practice/learned.h"
#include "traceur/practice/search.h"

namespace traceur::cli {
namespace {

using Json = nlohmann::ordered_json;
using practice::LearnedSkill;
using skill::Skill;

struct ExportArguments {
  std::string run;
  std::optional<double> task;
  std::string out;
  std::string into;
  int digits = 17;
  double period = 0.01;
  bool json = false;
};

/// The value of an expression that may name parameters, the task and the horizon.
double valueOf(const LearnedSkill& l, const std::string& text) {
  return control::Expression(text,
                             [&](const std::string& name) -> const double* {
                               if (name == "task") return &l.task;
                               if (name == "horizon") return &l.skill->horizon;
                               for (size_t i = 0; i < l.skill->parameters.size(); ++i) {
                                 if (l.skill->parameters[i].name == name) return &l.parameters[i];
                               }
                               for (const auto& [constant, value] : l.skill->constants) {
                                 if (constant == name) return &value;
                               }
                               return nullptr;
                             })
      .value();
}

/// The value, or the expression where it is only known as the skill runs.
Json said(const LearnedSkill& l, const std::string& text) {
  try {
    return valueOf(l, text);
  } catch (const InputError&) {
    return text;
  }
}

Json said(const LearnedSkill& l, const skill::VectorText& v) {
  return {said(l, v.x), said(l, v.y), said(l, v.z)};
}

Json forceJson(const LearnedSkill& l, const skill::ForceTerm& f) {
  const sim::Model& model = *l.skill->model;
  Json points = Json::array();
  for (const sim::BodyPoint& at : f.points) {
    points.push_back(
        {{"body", model.bodyName(at.body)}, {"at", {at.p_BP.x(), at.p_BP.y(), at.p_BP.z()}}});
  }
  Json j{{"force", said(l, f.force)},
         {"moment", said(l, f.moment)},
         {"frame", f.frame == skill::Frame::kWorld ? "world" : "cop to com"},
         {"only_where_touching", f.touching}};
  if (f.com) {
    j["com"] = true;
  } else {
    j["points"] = points;
  }
  for (const sim::BodyId body : f.against) j["against"].push_back(model.bodyName(body));
  return j;
}

Json gainsJson(const LearnedSkill& l, const std::vector<skill::GainFactor>& factors) {
  Json j = Json::object();
  for (const skill::GainFactor& f : factors) {
    j[l.skill->model->joints()[f.joint].name] = said(l, f.factor);
  }
  return j;
}

Json namesOf(const std::vector<bool>& during, const Skill& skill) {
  Json names = Json::array();
  const std::vector<std::string> phases = skill.phaseNames();
  for (size_t i = 0; i < during.size(); ++i) {
    if (during[i]) names.push_back(phases[i]);
  }
  return names;
}

bool exertsForces(const Skill& s) {
  return std::any_of(s.phases.begin(), s.phases.end(),
                     [](const skill::Phase& p) { return !p.forces.empty(); }) ||
         std::any_of(s.parts.begin(), s.parts.end(),
                     [](const skill::Part& p) { return exertsForces(*p.skill); });
}

/// What a program needs to run the skill itself: every number is worked out but what is only known
/// as it runs. Of goals in space it says only that targets come of them: the CSV has those.
/// @param begun  where the trial starts
Json skillJson(const LearnedSkill& l, const sim::State& begun) {
  const Skill& s = *l.skill;
  const auto& joints = s.model->joints();
  control::StablePd pd = skill::controllerOf(s);
  Json j{{"skill", s.name},
         {"task", {{"name", s.task.name}, {"unit", s.task.unit}, {"value", l.task}}},
         {"horizon", s.horizon}};
  if (!s.stop.empty()) j["stop"] = s.stop;
  for (const skill::Failure& f : s.failures) {
    j["failures"].push_back({{"name", f.name}, {"when", f.when}, {"during", namesOf(f.during, s)}});
  }
  for (size_t i = 0; i < s.parameters.size(); ++i) {
    j["parameters"][s.parameters[i].name] = {{"value", l.parameters[static_cast<Eigen::Index>(i)]},
                                             {"unit", s.parameters[i].unit}};
  }
  const control::JointTarget start = control::targetOf(*s.model, begun);
  for (size_t i = 0; i < joints.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const sim::JointLimit limit = pd.limits()[i];
    const auto finite = [](double x) { return std::isfinite(x) ? Json(x) : Json(); };
    j["joints"][joints[i].name] = {{"start", start.q[at]},
                                   {"kp", pd.gains()[i].kp},
                                   {"kd", pd.gains()[i].kd},
                                   {"ki", pd.gains()[i].ki},
                                   {"torque_limit", finite(limit.torque)},
                                   {"speed_limit", finite(limit.speed)},
                                   {"range", {finite(limit.min), finite(limit.max)}}};
  }
  for (size_t i = 0; i < s.phases.size(); ++i) {
    const skill::Phase& p = s.phases[i];
    Json phase{{"name", p.name}, {"blend", said(l, p.blend)}};
    phase["others"] = p.from_previous ? "keep the target of the phase before" : "base";
    if (!p.from_previous) {
      for (size_t k = 0; k < joints.size(); ++k) {
        phase["base"][joints[k].name] = p.base[static_cast<Eigen::Index>(k)];
      }
    }
    phase["targets"] = Json::object();
    for (const skill::JointValue& v : p.targets) {
      const Json target = said(l, v.expression);
      phase["targets"][joints[v.joint].name] =
          target.is_number() ? Json(v.sign * target.get<double>())
                             : Json(fmt::format("{:g} * ({})", v.sign, v.expression));
    }
    if (!p.stiffness.empty()) phase["stiffness"] = gainsJson(l, p.stiffness);
    if (!p.damping.empty()) phase["damping"] = gainsJson(l, p.damping);
    if (p.reach) phase["targets_from_goals_in_space"] = true;
    for (const skill::ForceTerm& f : p.forces) phase["virtual_forces"].push_back(forceJson(l, f));
    if (!p.forces.empty()) phase["within_motor_limits"] = p.limited;
    for (const skill::Exit& e : p.exits) {
      const auto next = static_cast<size_t>(e.next);
      phase["exits"].push_back(
          {{"when", e.when},
           {"then", next < s.phases.size() ? Json(s.phases[next].name) : Json()}});
    }
    j["phases"].push_back(std::move(phase));
  }
  j["feedback"] = Json::array();
  for (const skill::Feedback& f : s.feedback) {
    Json term{{"during", namesOf(f.during, s)}};
    for (const skill::JointValue& v : f.joints) {
      term["add"][joints[v.joint].name] = {{"sign", v.sign}, {"expression", v.expression}};
    }
    j["feedback"].push_back(std::move(term));
  }
  for (const skill::Part& part : s.parts) {
    LearnedSkill one{part.skill, valueOf(l, part.task), Eigen::VectorXd(part.parameters.size())};
    for (size_t i = 0; i < part.parameters.size(); ++i) {
      one.parameters[static_cast<Eigen::Index>(i)] = valueOf(l, part.parameters[i]);
    }
    Json each = skillJson(one, part.skill->start);
    each.erase("joints");  // the whole's
    each["name"] = part.name;
    if (!part.until.empty()) each["until"] = part.until;
    j["parts"].push_back(std::move(each));
  }
  return j;
}

void write(const std::string& file, const std::string& text) {
  PendingFile pending(file);
  pending.write(text);
  pending.commit();
}

/// The skill file begins where the run has ended.
int writeInto(const ExportArguments& a) {
  const practice::Run run = practice::Run::open(a.run);
  write(a.into, practice::withLearned(run, a.task, readFile(a.into), a.into, a.digits));
  const size_t all = run.meta().parameters.size();
  const size_t n = practice::namedBy(run.meta().search.only, run.meta().parameters).size();
  if (a.json) {
    printJson(Json{{"skill", a.into}, {"parameters", n}});
  } else {
    print("{}: {} of {} parameters begin where {} has ended\n", a.into, n, all, a.run);
  }
  return kDone;
}

int exportRun(const ExportArguments& a) {
  if (!a.into.empty()) return writeInto(a);
  const LearnedSkill l = practice::learnedSkill(practice::Run::open(a.run), a.task);
  const Skill& s = *l.skill;
  const double dt = s.model->timeStep();
  const auto every = static_cast<int>(std::lround(a.period / dt));
  if (every < 1) {
    throw InputError(
        fmt::format("--period {} s: expected at least the skill's time step, {} s", a.period, dt));
  }
  if (std::abs(every * dt - a.period) > 1e-9 * a.period) {
    const int fewer = std::max(1, static_cast<int>(a.period / dt));
    throw InputError(
        fmt::format("--period {} s: expected a multiple of the skill's time step, {} s, such as "
                    "{:g} or {:g}",
                    a.period, dt, fewer * dt, (fewer + 1) * dt));
  }
  if (!a.out.empty() && !std::filesystem::path(a.out).has_filename()) {
    throw InputError(fmt::format("--out {}: expected a name to begin the files' with", a.out));
  }
  std::string csv = fmt::format(
      "# targets of {}, {} {:g} {}, every {:g} s; feedback as in simulation\n"
      "time [s],phase",
      printable(s.name), printable(s.task.name), l.task, printable(s.task.unit), every * dt);
  for (const sim::Joint& j : s.model->joints()) {
    csv += "," + csvField(fmt::format("{} [{}]", j.name, j.slides ? "m" : "rad"));
  }
  csv += '\n';
  const std::vector<std::string> phases = s.phaseNames();
  int step = 0;
  int rows = 0;
  sim::Recording film;
  const skill::Rollout r = skill::Runner(l.skill).run(
      l.parameters, l.task, &film, [&](double time, int phase, const control::JointTarget& target) {
        if (step++ % every != 0) return;
        ++rows;
        csv += fmt::format("{:.6g},{}", time, csvField(phases[phase]));
        for (const double q : target.q) csv += fmt::format(",{:.6g}", q);
        csv += '\n';
      });
  const std::string stem =
      a.out.empty() ? beside(a.run, fmt::format("-{:g}", l.task)).string() : a.out;
  const std::string table = stem + "-targets.csv";
  const std::string controller = stem + "-controller.json";
  if (const auto folder = std::filesystem::path(stem).parent_path(); !folder.empty()) {
    makeFolder(folder);
  }
  write(table, csv);
  Json whole{{"format", "traceur controller"},
             {"version", 2},
             {"robot", s.model->robot() ? s.model->robot()->name : ""},
             {"units", "m, s, rad, N, N·m; world axes x forward, y left, z up"},
             {"time_step", s.model->timeStep()},
             {"achieved_in_simulation", numberOrNull(r.achieved)},
             {"ended", r.ended}};
  whole.update(skillJson(l, film.frames.front().state));
  write(controller, jsonText(whole) + "\n");
  const bool forces = exertsForces(s);
  const skill::Task& t = s.task;
  const std::optional<bool> reached = practice::reached(t, l.task, r);
  if (a.json) {
    Json j{{"targets", table},
           {"controller", controller},
           {"rows", rows},
           {"virtual_forces", forces},
           {"achieved_in_simulation", numberOrNull(r.achieved)},
           {"failed", r.failed()},
           {"ended", r.ended}};
    if (reached) j["within_tolerance"] = *reached;
    printJson(j);
    return r.failed() ? kFailed : kDone;
  }
  print("{}\n{}\n", table, controller);
  if (forces) {
    note(
        "traceur: {} exerts virtual forces: targets alone will not repeat it; see "
        "virtual_forces in the JSON\n",
        s.name);
  }
  if (r.failed()) note("traceur: in simulation it fails: {}\n", r.ended);
  if (!t.achieved.empty() && !r.failed() && std::isnan(r.achieved)) {
    note("traceur: in simulation nothing was there to measure what it achieves\n");
  } else if (!r.failed() && reached == false) {
    note(
        "traceur: in simulation it achieves {:.4g} {} for {:g} {}: not within the tolerance "
        "of {:g} {}\n",
        r.achieved, t.unit, l.task, t.unit, t.tolerance, t.unit);
  }
  return r.failed() ? kFailed : kDone;
}

}  // namespace

void addExport(CLI::App& program, int& exit_code) {
  auto a = std::make_shared<ExportArguments>();
  CLI::App* verb = program.add_subcommand(
      "export",
      "Write what was learned: for servos, joint targets over time and the controller; or into the "
      "skill file.");
  verb->add_option("RUN", a->run, "Run file of traceur learn")->required();
  verb->add_option("--task", a->task, "Of a family: what to ask for, in the skill's own unit");
  CLI::Option* period =
      verb->add_option("--period", a->period,
                       "Between two rows of targets [s], a multiple of the time step")
          ->check(CLI::Range(1e-4, 10.0))
          ->capture_default_str();
  CLI::Option* out = verb->add_option(
      "--out", a->out, "Writes OUT-targets.csv and OUT-controller.json; default: beside the run");
  CLI::Option* into =
      verb->add_option(
              "--into", a->into,
              "A skill file, whose parameters then begin with the learned numbers; of a run "
              "with --only, those that it searched")
          ->excludes(period)
          ->excludes(out);
  verb->add_option("--digits", a->digits,
                   "With --into: of each number; default: all, which repeat the trial to the bit")
      ->check(CLI::Range(2, 17))
      ->needs(into);
  verb->add_flag("--json", a->json, "Print one JSON object");
  verb->footer(
      "Examples:\n"
      "  traceur export runs/walk-family-seed1.run --task 0.1\n"
      "  traceur export runs/walk-family-seed1.run --task 0.1 --period 0.008 --out robot/walk\n"
      "  traceur export runs/land-0-seed1.run --into skills/human/land.toml\n"
      "Exit code: 0 done, 1 it fails in simulation or cannot be written, 2 wrong use.");
  verb->callback([a, &exit_code] { exit_code = exportRun(*a); });
}

}  // namespace traceur::cli
