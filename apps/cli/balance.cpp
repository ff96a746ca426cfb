// traceur balance: learn to balance on a bongo board that is not quite as its model says.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "apps/cli/arguments.h"
#include "apps/cli/balance_pictures.h"
#include "apps/cli/interrupt.h"
#include "apps/cli/output.h"
#include "apps/cli/verbs.h"
#include "traceur/bias/bongo_learning.h"
#include "traceur/bias/noisy_plant.h"
#include "traceur/bias/policy_file.h"
#include "traceur/bias/run_log_file.h"
#include "traceur/core/error.h"
#include "traceur/core/pending_file.h"
#include "traceur/core/text.h"
#include "traceur/core/toml.h"
#include "traceur/render/figure.h"

namespace traceur::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using Eigen::VectorXd;

struct BalanceArguments {
  std::string hardware;
  std::string method = "bias";
  std::string search = "starts";
  std::vector<std::string> data;
  std::string policy;
  std::string warm;
  std::string out;
  std::string map;
  std::string strip;
  std::string video;
  double angle = 0;
  int iterations = 10;
  int runs = 2;
  int starts = 100;
  std::uint64_t seed = 1;
  bool quiet = false;
  bool json = false;
};

bias::BongoMachine machineOf(const BalanceArguments& a) {
  return a.hardware.empty() ? bias::BongoMachine() : bias::readBongoMachine(a.hardware);
}

bias::BongoLearning learningOf(const BalanceArguments& a, double start_angle) {
  bias::BongoLearning o;
  o.start_angle = start_angle;
  o.method = bias::bongoMethod(a.method);
  o.search = bias::bongoSearch(a.search);
  o.iterations = a.iterations;
  o.runs = a.runs;
  o.seed = a.seed;
  return o;
}

std::string wordsOf(const VectorXd& parameters) {
  const auto h = bias::BalancePolicy::of(parameters).h;
  return fmt::format("H = ({:.4g}, {:.4g}, {:.4g}, {:.4g}, {:.4g})", h[0], h[1], h[2], h[3], h[4]);
}

std::vector<double> numbers(const VectorXd& v) {
  return {v.begin(), v.end()};
}

/// By filter, how many samples it is against.
Json leftOut(const bias::BongoSamples& samples) {
  Json j = Json::object();
  for (size_t f = 0; f < samples.left_out.size(); ++f) {
    if (samples.left_out[f] > 0) j[std::string(bias::bongoFilters()[f].name)] = samples.left_out[f];
  }
  return j;
}

/// "3 body angle, 1 rate".
std::string wordsOf(const bias::BongoSamples& samples) {
  std::string words;
  const Json counts = leftOut(samples);
  for (const auto& [name, count] : counts.items()) {
    words += fmt::format("{}{} {}", words.empty() ? "" : ", ", count.get<int>(), name);
  }
  return words.empty() ? "none" : words;
}

/// "1.23 s, board angle; cost 7.5e+05; 28 samples, left out: 2 rate".
std::string wordsOf(const bias::RunLog& log, const bias::BongoLearning& o,
                    const bias::BiasOptions& options) {
  const bias::Episode seen = bias::episodeOf(log, o.board);
  const bias::BongoSamples samples = bias::bongoSamples({log}, o.board, options);
  return fmt::format("{:.2f} s{}{}; cost {:.4g}; {} samples, left out: {}",
                     seen.steps * log.time_step, seen.failed() ? ", " : "", seen.failure, seen.cost,
                     samples.kept.size(), wordsOf(samples));
}

bool usesBias(bias::BongoMethod method) {
  return method == bias::BongoMethod::kBias || method == bias::BongoMethod::kPublished;
}

/// A learning as it went, with what the bias of each iteration explains of that iteration's runs.
/// @param logs  of all its runs, in their order
std::vector<LearningStep> stepsOf(const bias::BiasLearned& learned,
                                  const std::vector<bias::RunLog>& logs,
                                  const bias::BongoLearning& o) {
  const bool biased = usesBias(o.method);
  std::vector<LearningStep> steps;
  std::vector<bias::RunLog> before;  // that the iteration's bias was learned from
  auto next = logs.begin();
  for (const bias::BiasIteration& iteration : learned.iterations) {
    if (iteration.cleared) before.clear();
    LearningStep step{iteration.costs, {}};
    const std::vector<bias::RunLog> now(next,
                                        next + static_cast<std::ptrdiff_t>(step.costs.size()));
    next += static_cast<std::ptrdiff_t>(step.costs.size());
    if (biased && !before.empty()) {
      const bias::BiasOptions options = bias::bongoBias(o.method, before, o.board);
      const auto trained = bias::bongoSamples(before, o.board, options).kept;
      const auto unseen = bias::bongoSamples(now, o.board, options).kept;
      if (!trained.empty() && !unseen.empty()) {
        const VectorXd r2 =
            bias::explained(bias::DynamicsBias(bias::spread(trained, options), options), unseen);
        // The published method learns places, too; theirs come first.
        step.explained = r2.tail(std::min<Eigen::Index>(3, r2.size()));
      }
    }
    before.insert(before.end(), now.begin(), now.end());
    steps.push_back(std::move(step));
  }
  return steps;
}

/// What this folder's runs were made with. A folder holds one learning.
void claim(const fs::path& folder, const BalanceArguments& a, const bias::BongoMachine& machine) {
  Json j{{"format", "traceur balance"},
         {"version", 2},
         {"method", a.method},
         {"search", a.search},
         {"runs", a.runs},
         {"seed", a.seed},
         {"start_angle", machine.start_angle}};
  for (const bias::BongoFaultField& field : bias::bongoFaultFields()) {
    j["faults"][std::string(field.name)] = machine.faults.*field.value;
  }
  const std::string now = jsonText(j) + "\n";
  const fs::path file = folder / "learning.json";
  if (fs::exists(file)) {
    if (readFile(file) == now) return;
    throw InputError(
        fmt::format("{}: begun with another machine, method, search, runs or seed. "
                    "Choose another --out or remove the folder",
                    file.string()));
  }
  makeFolder(folder);
  PendingFile pending(file);
  pending.write(now);
  pending.commit();
}

int learn(const BalanceArguments& a) {
  Interrupt interrupt;
  const bias::BongoMachine machine = machineOf(a);
  const bias::BongoLearning o = learningOf(a, machine.start_angle);
  const fs::path folder = a.out.empty() ? fmt::format("runs/balance-seed{}", a.seed) : a.out;
  claim(folder, a, machine);
  const bool talks = !a.quiet && !a.json;
  const bias::LogFormat format = bias::bongoLogFormat();
  int recorded = 0;
  std::vector<bias::RunLog> logs;

  const auto run = [&](const VectorXd& parameters, int number) {
    const int iteration = number / o.runs + 1;
    const fs::path policy = folder / fmt::format("policy-{:02}.json", iteration);
    const fs::path file = folder / fmt::format("run-{:02}-{}.csv", iteration, number % o.runs + 1);
    if (number % o.runs == 0) {
      if (fs::exists(policy)) {
        if (bias::readPolicy(policy) != parameters) {
          throw InputError(fmt::format(
              "{}: another policy than this program finds from the logs before it: a log was "
              "changed, or another version wrote it",
              policy.string()));
        }
      } else {
        bias::writePolicy(policy, parameters);
      }
      if (talks) print("iteration {}  {}\n", iteration, wordsOf(parameters));
    }
    bias::PlantRun made;
    const bool there = fs::exists(file);
    if (there) {
      made.log = bias::readLog(file, format);
      made.cost = bias::episodeOf(made.log, o.board).cost;
      ++recorded;
    } else {
      made = bias::runMachine(machine, o.board, parameters, a.seed, number);
      bias::writeLog(file, made.log, format);
    }
    if (talks) {
      print("  run {}{}: {}\n", number + 1, there ? " (recorded)" : "",
            wordsOf(made.log, o, bias::bongoBias(o.method, {made.log}, o.board)));
      flushResults();
    }
    logs.push_back(made.log);
    return made;
  };

  bias::BiasLoopOptions loop = bias::bongoLoop(o);
  loop.stop = interrupt.token();
  const bias::BiasLearned learned =
      bias::learnWithBias(bias::bongoTask(o), bias::bongoLearner(o), run, loop);
  if (learned.stopped) {
    note("stopped; the same command goes on\n");
    return kInterrupted;
  }
  const std::vector<LearningStep> steps = stepsOf(learned, logs, o);
  writeLearning(folder / "learning.png", steps);
  const int good =
      bias::successes(machine, o.board, learned.parameters, a.starts, a.seed, interrupt.token());
  if (interrupt.token().stop_requested()) {
    note("stopped; the same command goes on\n");
    return kInterrupted;
  }
  const fs::path last = folder / fmt::format("policy-{:02}.json", learned.iterations.size());
  if (a.json) {
    Json j{{"solved", learned.solved},
           {"iterations", learned.iterations.size()},
           {"hardware_runs", learned.plant_runs},
           {"balanced_starts", good},
           {"starts", a.starts},
           {"policy", last.string()}};
    for (size_t i = 0; i < steps.size(); ++i) {
      const bias::BiasIteration& made = learned.iterations[i];
      j["costs"].push_back({{"model", made.policy.cost},
                            {"search_trials", made.policy.trials},
                            {"logs_given_up", made.cleared},
                            {"unseen_r2", numbers(steps[i].explained)},
                            {"hardware", made.costs}});
    }
    for (const bias::RunLog& log : logs) {
      const bias::Episode seen = bias::episodeOf(log, o.board);
      const bias::BiasOptions options = bias::bongoBias(o.method, {log}, o.board);
      j["runs"].push_back({{"seconds", seen.steps * log.time_step},
                           {"cost", seen.cost},
                           {"ended_by", seen.failure},
                           {"left_out", leftOut(bias::bongoSamples({log}, o.board, options))}});
    }
    printJson(j);
  } else if (!a.quiet) {
    std::vector<std::string> cleared;
    for (size_t i = 0; i < learned.iterations.size(); ++i) {
      if (learned.iterations[i].cleared) cleared.push_back(std::to_string(i + 1));
    }
    if (!cleared.empty()) {
      print("no policy balanced on what the logs taught, so they were given up, in iteration {}\n",
            join(cleared));
    }
    print(
        "{} after {} iterations, {} runs of the machine{}\n"
        "balances from {} of {} random starts\npolicy {}\nfigure {}\n",
        learned.solved ? "solved" : "not solved", learned.iterations.size(), learned.plant_runs,
        recorded > 0 ? fmt::format(" ({} recorded)", recorded) : "", good, a.starts, last.string(),
        (folder / "learning.png").string());
  }
  return learned.solved ? kDone : kFailed;
}

int fit(const BalanceArguments& a) {
  const bias::BongoMachine machine;
  const bias::BongoLearning o =
      learningOf(a, a.angle > 0 ? a.angle * std::numbers::pi / 180 : machine.start_angle);
  std::vector<bias::RunLog> logs;
  for (const std::string& file : a.data) {
    logs.push_back(bias::readLog(file, bias::bongoLogFormat()));
  }
  bias::BongoBoard model(o.board);
  const VectorXd noise = bias::readingNoise(logs, model, bias::bongoKeeps(o.board));
  const bias::BiasOptions options = bias::bongoBias(o.method, noise);
  std::vector<bias::BiasSample> train, test;
  bias::BongoSamples all;
  for (size_t l = 0; l < logs.size(); ++l) {
    if (std::abs(logs[l].time_step - model.timeStep()) > 1e-9) {
      throw InputError(fmt::format("{}: steps of {} s; the model's are {} s", a.data[l],
                                   logs[l].time_step, model.timeStep()));
    }
    const bias::BongoSamples of_log = bias::bongoSamples({logs[l]}, o.board, options);
    const auto& samples = of_log.kept;
    for (size_t i = 0; i < samples.size(); ++i) (i % 3 == 1 ? test : train).push_back(samples[i]);
    for (size_t f = 0; f < all.left_out.size(); ++f) all.left_out[f] += of_log.left_out[f];
  }
  static constexpr size_t kFewest = 10;  // [ours]
  const bool biased = usesBias(o.method);
  const bool learns = biased || o.method == bias::BongoMethod::kIdentify;
  if (learns && !logs.empty() && train.size() + test.size() < kFewest) {
    throw InputError(fmt::format(
        "--data: {} usable samples in {} logs, expected at least {}. A sample is {} readings; left "
        "out: {}",
        train.size() + test.size(), logs.size(), kFewest, options.average + 1, wordsOf(all)));
  }
  const VectorXd warm = a.warm.empty() ? VectorXd() : bias::readPolicy(a.warm);
  const bias::BiasTask task = bias::bongoTask(o);
  const bias::BiasLoopOptions loop = bias::bongoLoop(o);
  const bias::FoundPolicy found = bias::searchOnModels(
      task, bias::bongoLearner(o), logs, static_cast<int>(logs.size()) / o.runs, warm, loop.search);
  const std::string out = a.out.empty() ? "policy.json" : a.out;
  bias::writePolicy(out, found.parameters);

  VectorXd explained;
  if (biased && !test.empty() && !train.empty()) {
    explained = bias::explained(bias::DynamicsBias(bias::spread(train, options), options), test);
  }
  const double success = bias::BalanceCost().failure;
  const double hidden = task.most * static_cast<double>(task.starts.size() - 1);
  if (!logs.empty() && !(found.cost < task.success + hidden)) {
    note(
        "no policy balances on what the logs teach: learn would give them up and begin anew; "
        "leave --data out to do so\n");
  }
  if (a.json) {
    Json j{{"logs", logs.size()},
           {"samples", train.size() + test.size()},
           {"left_out", leftOut(all)},
           {"model_cost", found.cost},
           {"balances_on_model", found.cost < success},
           {"search_trials", found.trials},
           {"noise_variances", numbers(noise)},
           {"held_out_r2", numbers(explained)},
           {"policy", out}};
    for (const bias::RunLog& log : logs) {
      j["ended_by"].push_back(bias::episodeOf(log, o.board).failure);
    }
    printJson(j);
    return kDone;
  }
  if (a.quiet) return kDone;
  for (size_t l = 0; l < logs.size(); ++l) {
    print("{}: {}\n", a.data[l], wordsOf(logs[l], o, options));
  }
  print("{} logs, {} samples\n", logs.size(), train.size() + test.size());
  if (explained.size() > 0) {
    print("explained of a third held out, R2 by component:");
    for (const double r : explained) {
      print(" {}", std::isfinite(r) ? fmt::format("{:.3f}", r) : "-");
    }
    print("\nnoise of the readings, standard deviations: {:.2g} rad, {:.2g} rad/s\n",
          std::sqrt(noise.head<3>().mean()), std::sqrt(noise.tail<3>().mean()));
  }
  print("{}\n{} on the model in {} trials\npolicy {}\n", wordsOf(found.parameters),
        found.cost < success ? fmt::format("balances at a cost of {:.4g}", found.cost)
                             : "does not balance from every start",
        found.trials, out);
  return kDone;
}

int evaluate(const BalanceArguments& a) {
  if (!a.video.empty() && fs::path(a.video).extension() != ".mp4") {
    throw InputError(fmt::format("--video {}: expected .mp4", a.video));
  }
  if (!a.strip.empty() && fs::path(a.strip).extension() != ".png") {
    throw InputError(fmt::format("--strip {}: expected .png", a.strip));
  }
  if (!a.map.empty()) render::requireFigureName(a.map);
  bias::BongoMachine machine = machineOf(a);
  if (a.angle > 0) machine.start_angle = a.angle * std::numbers::pi / 180;
  const VectorXd parameters = bias::readPolicy(a.policy);
  Interrupt interrupt;  // before any other thread
  const int good = bias::successes(machine, {}, parameters, a.starts, a.seed, interrupt.token());
  interrupt.release();
  if (interrupt.asked()) return kInterrupted;
  if (a.json) {
    printJson(Json{{"balanced_starts", good}, {"starts", a.starts}});
  } else {
    print("{}\nbalances from {} of {} random starts\n", wordsOf(parameters), good, a.starts);
  }
  if (!a.strip.empty() || !a.video.empty()) {
    const double x = 0.6 * machine.start_angle;
    const auto runs = modelAndMachine(machine, parameters, bias::bongoStart(x, x));
    if (!a.strip.empty()) writeBalanceStrip(a.strip, runs);
    if (!a.video.empty()) writeBalanceVideo(a.video, runs);
  }
  if (!a.map.empty()) {
    static constexpr double kMapAngle = 0.035;  // rad [Ha2015, Fig. 42]
    const bool noisy = machine.faults.torque_variance + machine.faults.angle_variance +
                           machine.faults.rate_variance >
                       0;
    writeBalanceMap(a.map, machine, parameters, kMapAngle, 20, noisy ? 10 : 1, a.seed,
                    interrupt.token());
  }
  return interrupt.asked() ? kInterrupted : kDone;
}

int exportPolicy(const BalanceArguments& a) {
  const std::string text = bias::cHeader(bias::readPolicy(a.policy));
  if (a.out.empty()) {
    writeResult(text);
    return kDone;
  }
  PendingFile pending(a.out);
  pending.write(text);
  pending.commit();
  return kDone;
}

void addMethod(CLI::App* verb, BalanceArguments* a) {
  verb->add_option("--method", a->method,
                   fmt::format("What the logs are for: {}", join(bias::bongoMethods())))
      ->capture_default_str();
  verb->add_option("--search", a->search,
                   fmt::format("How a policy is searched: {}", join(bias::bongoSearches())))
      ->capture_default_str();
  verb->add_option("--seed", a->seed, "Equal seeds give equal runs")
      ->check(isSeed())
      ->capture_default_str();
}

}  // namespace

void addBalance(CLI::App& program, int& exit_code) {
  auto a = std::make_shared<BalanceArguments>();
  CLI::App* verb = program.add_subcommand(
      "balance", "Learn to balance on a bongo board that is not quite as its model says.");
  verb->require_subcommand(1);
  verb->footer(
      "Examples:\n"
      "  traceur balance learn --hardware models/bongo-board/hardware.toml\n"
      "  traceur balance learn --help");

  CLI::App* l = verb->add_subcommand(
      "learn", "The whole loop against a simulated machine; the same command again goes on.");
  l->add_option("--hardware", a->hardware,
                "The machine's faults (TOML); see models/bongo-board/hardware.toml. Default: none");
  addMethod(l, a.get());
  l->add_option("--iterations", a->iterations, "At most")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  l->add_option("--runs", a->runs, "Of the machine in each iteration; all must stay up")
      ->check(CLI::Range(1, 9))
      ->capture_default_str();
  l->add_option("--starts", a->starts, "Random starts the last policy is tried from")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  l->add_option("--out", a->out, "Folder of policies and logs; default: runs/balance-seedN");
  l->add_flag("--quiet", a->quiet, "Print nothing but errors");
  l->add_flag("--json", a->json, "Print one JSON object at the end");
  l->footer(
      "Examples:\n"
      "  traceur balance learn --hardware models/bongo-board/hardware.toml\n"
      "  traceur balance learn --hardware late.toml --method none    # the control\n"
      "Exit code: 0 solved, 1 not solved or failed, 2 wrong use, 130 stopped by Ctrl-C.");
  l->callback([a, &exit_code] { exit_code = learn(*a); });

  CLI::App* f = verb->add_subcommand(
      "fit", "One iteration for a real machine: from its logs to the policy to try next.");
  f->add_option("--data", a->data, "Logs (CSV), in the order they were recorded; none at first");
  f->add_option("--warm", a->warm, "The policy to begin the search with, such as the last one");
  addMethod(f, a.get());
  f->add_option("--angle", a->angle, "Wheel and board angles to balance from [deg]; default 0.5")
      ->check(CLI::Range(0.01, 5.0));
  f->add_option("--out", a->out, "Default: policy.json");
  f->add_flag("--quiet", a->quiet, "Print nothing but errors");
  f->add_flag("--json", a->json, "Print one JSON object at the end");
  f->footer(
      "Examples:\n"
      "  traceur balance fit --out policy-1.json                       # from the model alone\n"
      "  traceur balance fit --data run-1.csv run-2.csv --warm policy-1.json --out policy-2.json");
  f->callback([a, &exit_code] { exit_code = fit(*a); });

  CLI::App* e = verb->add_subcommand("evaluate", "Try a policy on a simulated machine.");
  e->add_option("POLICY", a->policy, "A policy that learn or fit wrote")->required();
  e->add_option("--hardware", a->hardware, "As of learn");
  e->add_option("--angle", a->angle, "Of random starts [deg]; default: the machine's")
      ->check(CLI::Range(0.01, 5.0));
  e->add_option("--starts", a->starts, "How many random starts")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  e->add_option("--seed", a->seed, "Of the starts and the noise")
      ->check(isSeed())
      ->capture_default_str();
  e->add_option("--strip", a->strip, "Draw model and machine side by side (PNG)");
  e->add_option("--video", a->video, "The same in motion (MP4)");
  e->add_option("--map", a->map,
                "Draw which wheel and board angles it balances from (.png, .svg; a CSV beside it)");
  e->add_flag("--json", a->json, "Print one JSON object");
  e->callback([a, &exit_code] { exit_code = evaluate(*a); });

  CLI::App* x = verb->add_subcommand("export", "A policy as a C header for a machine's program.");
  x->add_option("POLICY", a->policy, "A policy that learn or fit wrote")->required();
  x->add_option("--out", a->out, "Default: printed");
  x->callback([a, &exit_code] { exit_code = exportPolicy(*a); });
}

}  // namespace traceur::cli
