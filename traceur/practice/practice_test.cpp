#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "traceur/core/error.h"
#include "traceur/core/test_folder.h"
#include "traceur/practice/learn.h"
#include "traceur/practice/search.h"
#include "traceur/practice/tasks.h"
#include "traceur/practice/withstands.h"

namespace traceur::practice {
namespace {

namespace fs = std::filesystem;
using skill::Skill;

constexpr double kInf = std::numeric_limits<double>::infinity();
const char* const kNod = "tests/cli/nod.toml";

std::shared_ptr<const Skill> nod() {
  static const std::shared_ptr<const Skill> kSkill = Skill::fromFile(kNod);
  return kSkill;
}

/// The same skill with a part of its text replaced.
std::shared_ptr<const Skill> nodWith(const std::string& what, const std::string& by) {
  std::string text = nod()->text;
  for (size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size()) {
    text.replace(at, what.size(), by);
  }
  return Skill::fromText(text, kNod);
}

std::string messageOf(const auto& call) {
  try {
    call();
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

#define EXPECT_SAYS(call, words) \
  EXPECT_NE(messageOf([&] { call; }).find(words), std::string::npos) << messageOf([&] { call; })

SearchOptions quick(int budget, const VectorXd& tasks = {}) {
  SearchOptions o = learningOptions(tasks);
  o.budget = budget;
  o.seed = 7;
  return o;
}

std::vector<double> costsOf(const practice::Run& run) {
  std::vector<double> costs;
  for (const optim::Trial& t : run.trials()) costs.push_back(t.evaluation.cost);
  return costs;
}

void expectEqual(const ParamSpecs& a, const ParamSpecs& b) {
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].name, b[i].name);
    EXPECT_EQ(a[i].unit, b[i].unit);
    EXPECT_EQ(a[i].min, b[i].min);
    EXPECT_EQ(a[i].max, b[i].max);
    EXPECT_EQ(a[i].initial, b[i].initial);
  }
}

/// A row of a run's meta, written by another program.
void overwrite(const fs::path& file, const std::string& key, const std::string& value) {
  RunFile::open(file, true).setMeta({{key, value}});
}

TEST(Run, SaysWhatItWasToldOfASkill) {
  const TestFolder folder;
  const RunMeta asked{
      .search = {.seed = ~std::uint64_t{0},
                 .budget = 70,
                 .optimiser = "contextual",
                 .population = 12,
                 .step_size = 0.1,
                 .tasks = VectorXd::LinSpaced(3, 0.1, 0.7),
                 .curve = "linear",
                 .experience = "x.run",
                 .from = "y.run",
                 .only = {"a", "b*"},
                 .given = {"height=2:5", "hands=1"},
                 .draws = 6},
      .parameters = {{"a", "rad", -1, 1, 0.1, ""}, {"b", "", 0, 1e-300, 1e-301, ""}},
      .constraints = {"fall", "slip"},
      .skill = SkillInRun{.name = "nod",
                          .file = "n.toml",
                          .text = "text",
                          .robot = 0xffffffff00000001,
                          .parts = 17,
                          .engine = "engine 1",
                          .task = 0,
                          .task_unit = "rad"}};
  practice::Run::begin(folder / "a.run", asked, false);
  const practice::Run run = practice::Run::open(folder / "a.run");
  const RunMeta& m = run.meta();
  EXPECT_FALSE(m.traceur.empty());
  EXPECT_EQ(m.search.seed, asked.search.seed);
  EXPECT_EQ(m.search.budget, 70);
  EXPECT_EQ(m.search.optimiser, "contextual");
  EXPECT_EQ(m.search.population, 12);
  EXPECT_EQ(m.search.step_size, 0.1);
  EXPECT_EQ(m.search.tasks, asked.search.tasks);
  EXPECT_EQ(m.search.curve, "linear");
  EXPECT_EQ(m.search.experience, "x.run");
  EXPECT_EQ(m.search.from, "y.run");
  EXPECT_EQ(m.search.only, asked.search.only);
  EXPECT_EQ(m.search.given, asked.search.given);
  EXPECT_EQ(m.search.draws, 6);
  expectEqual(m.parameters, asked.parameters);
  EXPECT_EQ(m.constraints, asked.constraints);
  ASSERT_TRUE(m.skill);
  EXPECT_FALSE(m.command);
  EXPECT_EQ(m.skill->name, "nod");
  EXPECT_EQ(m.skill->robot, asked.skill->robot);
  EXPECT_EQ(m.skill->parts, 17u);
  EXPECT_EQ(m.skill->engine, "engine 1");
  EXPECT_EQ(m.skill->task_unit, "rad");
  EXPECT_TRUE(run.isFamily());
  EXPECT_FALSE(run.outcome());
}

TEST(Run, SaysWhatItWasToldOfNumbers) {
  const TestFolder folder;
  const RunMeta asked{.search = {.optimiser = "cma-c"},
                      .parameters = {{"a, [b]", "", -kInf, 2, 1, ""}, {"c", "", 0, kInf, 1, ""}},
                      .command = CommandInRun{"./f 1", "a, [b]=-inf:2"}};
  practice::Run::begin(folder / "a.run", asked, false);
  const practice::Run run = practice::Run::open(folder / "a.run");
  expectEqual(run.meta().parameters, asked.parameters);
  EXPECT_TRUE(run.meta().constraints.empty());
  ASSERT_TRUE(run.meta().command);
  EXPECT_EQ(run.meta().command->command, "./f 1");
  EXPECT_FALSE(run.isFamily());
  EXPECT_SAYS(run.recording(), "a search of numbers");
  EXPECT_SAYS(skillOf(run), "not a run of traceur learn");
}

TEST(Run, OfABeforeIsReadAndGoesOn) {
  const TestFolder folder;
  learn(nod(), 0.1, quick(32), folder / "a.run", false, {});
  const std::vector<double> whole = [&] {
    learn(nod(), 0.1, quick(64), folder / "b.run", false, {});
    return costsOf(practice::Run::open(folder / "b.run"));
  }();
  overwrite(folder / "a.run", "parameters", "shoulder [rad], elbow [rad]");
  {
    RunFile file = RunFile::open(folder / "a.run", true);
    file.forget({}, {"from", "reached", "objectives", "measures"});
    const practice::Run run = practice::Run::open(folder / "a.run");
    ASSERT_EQ(run.meta().parameters.size(), 2u);
    EXPECT_EQ(run.meta().parameters[1].name, "elbow");
    EXPECT_EQ(run.meta().parameters[1].unit, "rad");
    EXPECT_EQ(run.meta().parameters[1].max, kInf);
    ASSERT_TRUE(run.outcome());
    EXPECT_TRUE(run.outcome()->achieved);
    EXPECT_FALSE(run.outcome()->reached);
    EXPECT_TRUE(run.outcome()->measures.empty());
  }
  learn(nod(), 0.1, quick(64), folder / "a.run", true, {});
  EXPECT_EQ(costsOf(practice::Run::open(folder / "a.run")), whole);
  EXPECT_EQ(practice::Run::open(folder / "a.run").outcome()->measures.size(), 2u);
  overwrite(folder / "a.run", "parameters", "shoulder [rad], wrist [rad]");
  EXPECT_SAYS(learn(nod(), 0.1, quick(64), folder / "a.run", true, {}),
              "cannot be resumed with other parameters: it has shoulder [rad], wrist [rad], got "
              "shoulder [rad], elbow [rad]");
  overwrite(folder / "a.run", "parameters", "a, b");
  EXPECT_EQ(practice::Run::open(folder / "a.run").meta().parameters[1].name, "b");
  EXPECT_EQ(practice::Run::open(folder / "a.run").meta().parameters[1].unit, "");
}

TEST(Run, ThatIsNoneIsRefused) {
  const TestFolder folder;
  learn(nod(), 0.1, quick(16), folder / "a.run", false, {});
  const auto with = [&](const char* key, const char* value) {
    fs::remove(folder / "b.run");
    fs::copy_file(folder / "a.run", folder / "b.run");
    overwrite(folder / "b.run", key, value);
    return messageOf([&] {
      const practice::Run run = practice::Run::open(folder / "b.run");
      run.outcome();
      run.familyCosts();
    });
  };
  EXPECT_EQ(with("seed", "12"), "");
  for (const char* wrong : {"", "x", "1x", "-1", "1.5", "18446744073709551616"}) {
    EXPECT_NE(with("seed", wrong).find("seed"), std::string::npos) << wrong;
    EXPECT_NE(with("budget", wrong).find("budget"), std::string::npos) << wrong;
  }
  EXPECT_NE(with("tasks", "1:0:3").find("tasks"), std::string::npos);
  EXPECT_NE(with("parameters", "[1]").find("parameters"), std::string::npos);
  const std::string cut = with("parameters", "[{");
  EXPECT_NE(cut.find("not a run file of this version"), std::string::npos) << cut;
  EXPECT_EQ(cut.find("json"), std::string::npos) << cut;  // of whose reader it is, nobody asked
  EXPECT_NE(with("measures", "{}x").find("measures"), std::string::npos);
  EXPECT_NE(with("family_costs", "12").find("family_costs"), std::string::npos);
  EXPECT_NE(with("family_costs", "1e30:1").find("family_costs"), std::string::npos);
}

TEST(Learn, KeepsWhatTheBestTrialDid) {
  const TestFolder folder;
  const Learned l = learn(nod(), 0.1, quick(64), folder / "a.run", false, {});
  const practice::Run run = practice::Run::open(folder / "a.run");
  const Outcome o = run.outcome().value();
  EXPECT_EQ(l.summary.progress.evaluations, 64);
  ASSERT_TRUE(l.best);
  EXPECT_EQ(o.hash, l.best->hash);
  EXPECT_EQ(o.achieved, l.best->achieved);
  EXPECT_EQ(o.reached, l.reached);
  ASSERT_EQ(o.measures.size(), 2u);
  EXPECT_EQ(o.measures[0].name, "raised");
  EXPECT_EQ(o.measures[0].value, l.best->achieved);
  EXPECT_EQ(o.measures[0].unit, "rad");
  ASSERT_EQ(o.objectives.size(), 1u);
  EXPECT_EQ(o.objectives[0].value, l.best->cost);

  const LearnedSkill learned = learnedSkill(run);
  EXPECT_EQ(learned.task, 0.1);
  EXPECT_EQ(learned.perform().hash, o.hash);
  EXPECT_EQ(learned.parameters, l.summary.progress.best->x);
  EXPECT_EQ(learnedSkill(run, 0.1).parameters, learned.parameters);
  EXPECT_SAYS(learnedSkill(run, 0.2), "was learned for 0.1 rad alone");
  EXPECT_SAYS(learnedFamily(run), "not a family of a skill");
  EXPECT_EQ(run.recording().frames.size(), [&] {
    sim::Recording again;
    learned.perform(&again);
    return again.frames.size();
  }());
}

TEST(Learn, GivesEqualTrialsForAnyThreadsAndAfterAStop) {
  const TestFolder folder;
  for (const bool family : {false, true}) {
    SCOPED_TRACE(family);
    const std::string name = family ? "family" : "one";
    const SearchOptions o = quick(160, family ? toTasks("0:1:3", "tasks") : VectorXd());
    learn(nod(), 0.1, o, folder / (name + ".run"), false, {.threads = 1});
    std::stop_source source;
    const auto stop = [&](const optim::Progress& p, const auto&) {
      if (p.generation == 2) source.request_stop();
    };
    const Learned part = learn(nod(), 0.1, o, folder / (name + "2.run"), false,
                               {.threads = 2, .stop = source.get_token(), .on_generation = stop});
    EXPECT_EQ(part.summary.end, optim::End::kInterrupted);
    int shown = -1;
    learn(nod(), 0.1, o, folder / (name + "2.run"), true,
          {.threads = 2, .on_generation = [&](const optim::Progress& p, const auto&) {
             if (shown < 0) shown = p.evaluations;
           }});
    EXPECT_EQ(shown, part.summary.progress.evaluations);
    const practice::Run a = practice::Run::open(folder / (name + ".run"));
    const practice::Run b = practice::Run::open(folder / (name + "2.run"));
    EXPECT_EQ(costsOf(a), costsOf(b));
    EXPECT_EQ(a.file().state(), b.file().state());
    EXPECT_EQ(a.file().meta("family"), b.file().meta("family"));
    EXPECT_EQ(a.file().meta("family_costs"), b.file().meta("family_costs"));
  }
}

TEST(Learn, OfAFamilyGivesParametersForEachTask) {
  const TestFolder folder;
  const Learned l =
      learn(nod(), 0, quick(200, toTasks("0:1:3", "tasks")), folder / "f.run", false, {});
  ASSERT_TRUE(l.family);
  EXPECT_FALSE(l.reached) << "nod has no target_cost";
  const practice::Run run = practice::Run::open(folder / "f.run");
  const LearnedFamily f = learnedFamily(run);
  EXPECT_EQ(f.family.task_costs, l.family->task_costs);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(f.at(f.tasks[i]).perform().cost, l.family->task_costs[i], 1e-12) << i;
  }
  EXPECT_EQ(learnedSkill(run, 0.3).parameters, f.at(0.3).parameters);
  EXPECT_SAYS(f.at(1.5), "task 1.5 rad: this family was learned for 0 to 1");
  EXPECT_SAYS(f.at(NAN), "this family was learned for 0 to 1");
  EXPECT_SAYS(learnedSkill(run), "expected --task");
  EXPECT_SAYS(run.recording(), "expected --task");
  EXPECT_GT(recordingOf(run, 0.5).frames.size(), 0u);
  EXPECT_EQ(run.familyCosts().back().cost, l.family->cost);
}

TEST(Learn, OfASkillMadeOfOthersKnowsThemAgain) {
  const TestFolder folder;
  const auto write = [&](const char* name, const std::string& text) {
    std::ofstream(folder / name) << text;
    return folder / name;
  };
  const std::string robot = fs::absolute("models/bioloid-gp/robot.toml").string();
  std::string part = nod()->text;
  part.replace(part.find("\"bioloid-gp\""), 12, "\"" + robot + "\"");
  write("nod.toml", part);
  const auto whole = Skill::fromFile(
      write("whole.toml",
            "name = \"whole\"\nhorizon = 1\nrobot = \"" + robot +
                "\"\n[parameters]\nb = { range = [0, 1], "
                "initial = 0.2 }\n[start.pose]\nbase = \"stand\"\n[[skill]]\nfile = \"nod.toml\"\n"
                "parameters = { shoulder = \"b\" }\n[[objective]]\nname = \"sum\"\ncost = "
                "\"nod.cost\"\n"));
  learn(whole, 0, quick(16), folder / "a.run", false, {});
  const practice::Run run = practice::Run::open(folder / "a.run");
  EXPECT_EQ(learnedSkill(run).perform().hash, run.outcome()->hash);
  part.replace(part.find("horizon = 0.1"), 13, "horizon = 0.2");
  write("nod.toml", part);
  EXPECT_SAYS(learnedSkill(run), "a skill that whole is made of has changed since");
  EXPECT_SAYS(
      learn(Skill::fromFile(folder / "whole.toml"), 0, quick(32), folder / "a.run", true, {}),
      "the skill or robot file has changed since it began");
}

TEST(Learn, RefusesWhatDoesNotSuit) {
  const TestFolder folder;
  const fs::path out = folder / "a.run";
  const auto with = [&](double task, const SearchOptions& o) {
    return messageOf([&] { learn(nod(), task, o, out, false, {}); });
  };
  EXPECT_NE(with(7, quick(16)).find("task 7 rad: nod asks for shoulder angle within [0, 1]"),
            std::string::npos);
  EXPECT_NE(with(0, quick(16, toTasks("0:2:3", ""))).find("[0, 1]"), std::string::npos);
  SearchOptions o = quick(16);
  o.curve = "cubic";
  EXPECT_NE(with(0, o).find("a curve is for a family"), std::string::npos);
  o = quick(16);
  o.experience = "none.run";
  EXPECT_NE(with(0, o).find("cma-es does not learn from it: expected optimiser cma-c"),
            std::string::npos);
  o = quick(16, toTasks("0:1:3", ""));
  o.optimiser = "cma-es";
  EXPECT_NE(with(0, o).find("no optimiser of families"), std::string::npos);
  EXPECT_FALSE(fs::exists(out));
}

TEST(Beginning, IsWhereTheOtherRunEndedByName) {
  const TestFolder folder;
  const Learned l = learn(nod(), 0.1, quick(64), folder / "a.run", false, {});
  const VectorXd found = l.summary.progress.best->x;
  const practice::Run run = practice::Run::open(folder / "a.run");
  const ParamSpecs here = {{"elbow", "rad", -2, 2, 0, ""},
                           {"other", "m", 3, 5, 4, ""},
                           {"shoulder", "rad", 0.5, 1, 0.6, ""}};
  const Beginning b = beginningFrom(run, here, 0);
  EXPECT_EQ(b.taken, (std::vector<std::string>{"elbow", "shoulder"}));
  EXPECT_EQ(b.parameters[0].initial, found[1]);
  EXPECT_EQ(b.parameters[1].initial, 4);
  ASSERT_LT(found[0], 0.5) << "or it need not be moved";
  EXPECT_EQ(b.parameters[2].initial, 0.5);
  EXPECT_EQ(b.moved, std::vector<std::string>{"shoulder"});
  EXPECT_SAYS(beginningFrom(run, {{"elbow", "deg", 0, 1, 0, ""}}, 0),
              "its elbow is in \"rad\", here it is in \"deg\"");
  EXPECT_SAYS(beginningFrom(run, {{"knee", "rad", 0, 1, 0, ""}}, 0),
              "knows none of the parameters here, knee [rad]: it has shoulder [rad], elbow [rad]");
}

TEST(Beginning, OfAFamilyIsForTheTask) {
  const TestFolder folder;
  learn(nod(), 0, quick(200, toTasks("0.2:0.8:3", "")), folder / "f.run", false, {});
  const practice::Run run = practice::Run::open(folder / "f.run");
  const LearnedFamily f = learnedFamily(run);
  const auto beginning = [&](double task) {
    return initialOf(beginningFrom(run, nod()->parameters, task).parameters);
  };
  EXPECT_EQ(beginning(0.3), f.at(0.3).parameters);
  EXPECT_EQ(beginning(1), f.at(0.8).parameters) << "the nearest there is";
}

TEST(Learn, BeginsWhereAnotherRunEndedAndGoesOn) {
  const TestFolder folder;
  const auto skill = nodWith("elbow", "bend");  // one parameter has another name
  const Learned l = learn(nod(), 0.1, quick(64), folder / "a.run", false, {});
  SearchOptions o = quick(32);
  o.from = (folder / "a.run").string();
  o.step_size = 1e-9;
  const Learned next = learn(skill, 0.1, o, folder / "b.run", false, {});
  ASSERT_TRUE(next.beginning);
  EXPECT_EQ(next.beginning->taken, std::vector<std::string>{"shoulder"});
  for (const optim::Trial& t : practice::Run::open(folder / "b.run").trials()) {
    EXPECT_NEAR(t.x[0], l.summary.progress.best->x[0], 1e-6);
    EXPECT_NEAR(t.x[1], 0.5, 1e-6);
  }
  o.budget = 48;
  EXPECT_EQ(learn(skill, 0.1, o, folder / "b.run", true, {}).summary.progress.evaluations, 48);
  learn(nod(), 0.1, quick(128), folder / "a.run", true, {});
  EXPECT_SAYS(learn(skill, 0.1, o, folder / "b.run", true, {}), "has changed since");
  o.from = "";
  EXPECT_SAYS(learn(skill, 0.1, o, folder / "b.run", true, {}), "another from");
}

TEST(Learned, BecomesWhereASkillBegins) {
  const TestFolder folder;
  SearchOptions o = quick(64);
  o.only = {"elb*"};
  const Learned l = learn(nod(), 0.1, o, folder / "a.run", false, {});
  const practice::Run run = practice::Run::open(folder / "a.run");
  const std::string text = "# mine\n" + nod()->text;
  const std::string with = withLearned(run, {}, text, kNod);
  EXPECT_TRUE(with.starts_with("# mine\n"));
  const auto skill = Skill::fromText(with, kNod);
  EXPECT_EQ(skill->initialParameters(), l.summary.progress.best->x);
  EXPECT_NE(skill->initialParameters(), nod()->initialParameters());
  const auto rounded = Skill::fromText(withLearned(run, {}, text, kNod, 3), kNod);
  EXPECT_NEAR(rounded->initialParameters()[1], skill->initialParameters()[1], 5e-3);
  EXPECT_NE(rounded->initialParameters()[1], skill->initialParameters()[1]);
  // Of what was not searched, the file's own stays.
  const auto other = nodWith("initial = 0.5", "initial = 0.25");
  ASSERT_NE(other->text, nod()->text);
  EXPECT_EQ(Skill::fromText(withLearned(run, {}, other->text, kNod), kNod)->initialParameters()[0],
            0.25);
  EXPECT_SAYS(withLearned(run, {}, nodWith("elbow", "bend")->text, kNod),
              "parameters.elbow.initial");
}

TEST(Search, NamesParametersAsAShellNamesFiles) {
  ParamSpecs all;
  for (const char* name : {"squat_hip", "squat_knee", "dive_hip"}) {
    all.push_back({.name = name, .unit = "", .min = 0, .max = 1, .initial = 0, .help = ""});
  }
  EXPECT_EQ(practice::namedBy({}, all), (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(practice::namedBy({"squat_*"}, all), (std::vector<int>{0, 1}));
  EXPECT_EQ(practice::namedBy({"dive_hip", "*_hip"}, all), (std::vector<int>{0, 2}));
  EXPECT_EQ(practice::namedBy({"squat_[hk]*"}, all), (std::vector<int>{0, 1}));
  EXPECT_SAYS(practice::namedBy({"squat"}, all), "no parameter named \"squat\"");
}

TEST(Learned, IsAddedToASkillThatIsLikeAnother) {
  const TestFolder folder;
  const std::filesystem::path file = folder / "own.toml";
  std::ofstream(folder / "nod.toml") << nod()->text;
  SearchOptions o = quick(64);
  const Learned l = learn(nod(), 0.1, o, folder / "a.run", false, {});
  const practice::Run run = practice::Run::open(folder / "a.run");
  const auto best = l.summary.progress.best->x;
  // None said, one said as a number, all said as a row.
  for (const std::string own :
       {"", "[parameters]\nelbow = 0.1\n", "[parameters]\nelbow = { initial = 0.1 }\n"}) {
    const std::string text = "like = \"nod.toml\"\n" + own;
    const std::string with = withLearned(run, {}, text, file.string());
    const auto skill = Skill::fromText(with, file);
    EXPECT_EQ(skill->initialParameters(), best) << with;
    EXPECT_EQ(withLearned(run, {}, with, file.string()), with);
  }
  // What it is like belongs to what was learned.
  std::ofstream(file) << "like = \"nod.toml\"\n";
  const auto own = Skill::fromFile(file);
  learn(own, 0.1, o, folder / "b.run", false, {});
  EXPECT_NO_THROW(skillOf(practice::Run::open(folder / "b.run")));
  std::ofstream(folder / "nod.toml", std::ios::app) << "# changed\n";
  EXPECT_SAYS(skillOf(practice::Run::open(folder / "b.run")), "has changed since");
}

TEST(Learn, UnderGivenConditionsIsWhatTheRunRepeats) {
  const TestFolder folder;
  const auto skill =
      Skill::fromText(nod()->text +
                          "[conditions]\nload = { range = [0, 2], default = 0, draw = [0, 1] }\n"
                          "[[objective]]\nname = \"load\"\ncost = \"10 * load\"\n",
                      kNod);
  SearchOptions o = quick(16);
  o.given = {"load=1.5:1.6"};
  o.draws = 3;
  const Learned l = learn(skill, 0.1, o, folder / "a.run", false, {});
  EXPECT_GT(l.summary.progress.best->evaluation.cost, 15);
  const practice::Run run = practice::Run::open(folder / "a.run");
  EXPECT_EQ(learnedSkill(run).perform().hash, run.outcome()->hash);
  EXPECT_GT(learnedSkill(run).perform().cost, 15);
  o.given = {};
  EXPECT_SAYS(learn(skill, 0.1, o, folder / "a.run", true, {}), "another given");
}

TEST(Keep, MakesOneTrialARun) {
  const TestFolder folder;
  const LearnedSkill what{nod(), 0.4, VectorXd{{0.4, 0.01}}};
  sim::Recording recording;
  const skill::Rollout r = what.perform(&recording);
  keep(what, r, recording, folder / "a.run");
  const practice::Run run = practice::Run::open(folder / "a.run");
  EXPECT_EQ(run.progress().evaluations, 1);
  EXPECT_EQ(run.progress().best->evaluation.cost, r.cost);
  EXPECT_EQ(learnedSkill(run).parameters, what.parameters);
  EXPECT_EQ(learnedSkill(run).task, 0.4);
  EXPECT_EQ(run.outcome()->hash, r.hash);
  EXPECT_EQ(run.recording().frames.size(), recording.frames.size());
  EXPECT_EQ(initialOf(beginningFrom(run, nod()->parameters, 0).parameters), what.parameters);
  EXPECT_SAYS(keep(what, r, recording, folder / "a.run"), "exists already");
  EXPECT_SAYS(learn(nod(), 0.4, quick(16), folder / "a.run", true, {}), "another optimiser");
}

TEST(Reached, IsWithinTheToleranceWithoutAFailure) {
  skill::Task task;
  task.tolerance = 0.01;
  skill::Rollout r;
  r.achieved = 0.509;
  EXPECT_EQ(reached(task, 0.5, r), std::nullopt) << "a skill that does not say";
  task.achieved = "apex";
  EXPECT_EQ(reached(task, 0.5, r), true);
  EXPECT_EQ(reached(task, 0.52, r), false);
  r.violated = {true};
  EXPECT_EQ(reached(task, 0.5, r), false);
  r.violated = {};
  r.achieved = NAN;
  EXPECT_EQ(reached(task, 0.5, r), false);
}

TEST(Measures, HaveTheUnitsOfTheirSignals) {
  const auto skill = nodWith("bent   = { of = \"joint.l_hand\", take = \"last\" }",
                             "bent = { of = \"joint.l_hand\", take = \"last\" }\n"
                             "speed = { of = \"com_velocity.x\", take = \"mean\" }\n"
                             "way = { of = \"com_velocity.x\", take = \"integral\" }\n"
                             "lasted = { of = \"1\", take = \"integral\" }\n"
                             "twice = { of = \"2 * com.z\", take = \"max\" }\n"
                             "said = { of = \"2 * com.z\", take = \"integral\", unit = \"m·s\" }\n"
                             "touching = { of = \"contact.feet\", take = \"max\" }");
  const skill::Rollout r = LearnedSkill{skill, 0.1, skill->initialParameters()}.perform();
  std::vector<std::string> units;
  for (const Quantity& q : measuresOf(*skill, r)) units.push_back(q.unit);
  EXPECT_EQ(units, (std::vector<std::string>{"rad", "rad", "m/s", "m/s·s", "s", "", "m·s", ""}));
  EXPECT_EQ(measuresOf(*skill, r)[1].value, r.measures[1]);
}

TEST(Withstands, TriesEachUnderEachDisturbance) {
  const std::vector<LearnedSkill> what = {{nod(), 0.2, VectorXd{{0.2, 0}}},
                                          {nod(), 0.4, VectorXd{{0.4, 0}}}};
  int last = -1;
  const auto all = withstands(what, {.seed = 3, .threads = 1, .on_done = [&](int done, int of) {
                                       EXPECT_EQ(done, last + 1);
                                       EXPECT_EQ(of, 40);
                                       last = done;
                                     }});
  EXPECT_EQ(last, 40);
  ASSERT_EQ(all.size(), 40u);
  const auto again = withstands(what, {.seed = 3, .threads = 2});
  std::map<std::string, int> kinds;
  for (size_t i = 0; i < all.size(); ++i) {
    ++kinds[all[i].kind];
    ASSERT_EQ(all[i].rollouts.size(), 2u);
    for (int t : {0, 1}) EXPECT_EQ(all[i].rollouts[t].hash, again[i].rollouts[t].hash) << i;
  }
  EXPECT_EQ(kinds["drawn"], 20);
  EXPECT_EQ(kinds["mass"], 5);
  EXPECT_EQ(kinds.size(), disturbanceKinds().size());
  // The model's own mass is among the levels: as if nothing were disturbed.
  for (const Withstood& w : all) {
    if (w.kind == "mass" && w.level == 1) {
      EXPECT_EQ(w.rollouts[0].hash, what[0].perform().hash);
    }
  }
  std::stop_source source;
  source.request_stop();
  for (const Withstood& w : withstands(what, {.stop = source.get_token()})) {
    EXPECT_TRUE(w.rollouts.empty());
  }
}

TEST(Tasks, AreWrittenAndReadAlike) {
  const VectorXd tasks = toTasks("0.03:0.08:6", "here");
  EXPECT_EQ(tasks.size(), 6);
  EXPECT_EQ(tasksText(tasks), "0.03:0.08:6");
  EXPECT_EQ(tasksText(toTasks("0.030:8e-2:6", "here")), "0.03:0.08:6");
  EXPECT_EQ(tasksText({}), "");
  for (const char* wrong : {"", "0:1", "0:1:1", "1:0:3", "0:1:3:", "0:1:2.5", "0:inf:3", "a:1:3"}) {
    EXPECT_SAYS(toTasks(wrong, "here"), "here: ") << wrong;
  }
  EXPECT_EQ(controlPointsOf("cubic", 4), 4);
  EXPECT_SAYS(controlPointsOf("cubic", 3), "at least 4 tasks, got 3");
}

}  // namespace
}  // namespace traceur::practice
