// traceur render and traceur plot: look at a run.
#include "apps/cli/pictures.h"

#include <fmt/format.h>

#include <filesystem>

#include "apps/cli/output.h"
#include "apps/cli/performance.h"
#include "apps/cli/progress.h"
#include "apps/cli/verbs.h"
#include "traceur/clip/bvh.h"
#include "traceur/core/error.h"
#include "traceur/core/pending_file.h"
#include "traceur/core/process.h"
#include "traceur/practice/learned.h"
#include "traceur/render/film_strip.h"
#include "traceur/render/gltf.h"
#include "traceur/render/standard_figures.h"
#include "traceur/render/video.h"

namespace traceur::cli {
namespace {

namespace fs = std::filesystem;

const std::map<std::string, render::View> kViews = {{"side", render::View::kSide},
                                                    {"three-quarter", render::View::kThreeQuarter},
                                                    {"front", render::View::kFront}};

/// Thrown out of a picture or video that was asked to stop.
struct Stopped {};

struct RenderArguments : DrawArguments {
  std::string run;
  std::vector<std::string> files;
  std::optional<double> task;
  bool quiet = false;
};

/// What is added to the run's name: of a family, the task.
std::string suffix(const std::optional<double>& task) {
  return task ? fmt::format("-{:g}", *task) : "";
}

int renderRun(const RenderArguments& a) {
  Interrupt interrupt;  // before any other thread
  const practice::Run run = practice::Run::open(a.run);
  std::vector<fs::path> files(a.files.begin(), a.files.end());
  if (files.empty()) {
    files = {beside(a.run, suffix(a.task) + "-strip.png"), beside(a.run, suffix(a.task) + ".mp4")};
  }
  for (const fs::path& f : files) requirePicture(f);
  const sim::Recording recording = practice::recordingOf(run, a.task);
  for (const fs::path& f : files) {
    if (!draw(recording, f, a, interrupt, a.quiet)) return kInterrupted;
    if (!a.quiet) print("{}\n", f.string());
  }
  return kDone;
}

render::CostHistory historyOf(const practice::Run& run) {
  // Of the best curve, not of single trials: each is for all tasks and suits few.
  if (const auto costs = run.familyCosts(); !costs.empty()) {
    render::CostHistory history;
    for (const practice::FamilyCost& c : costs) {
      history.evaluations.push_back(c.trials);
      history.best.push_back(c.cost);
    }
    return history;
  }
  std::vector<render::CostTrial> trials;
  for (const TrialRow& row : run.file().trials()) {
    trials.push_back({row.cost, !row.violated.empty(), row.failed});
  }
  return render::costHistory(trials);
}

struct PlotArguments {
  std::string run;
  std::optional<double> task;
  std::vector<std::string> what;
  std::string format = "png";
  std::string out;
};

int plotRun(const PlotArguments& a) {
  const practice::Run run = practice::Run::open(a.run);
  std::vector<std::string> what = a.what;
  const bool motion = run.file().recording("best").has_value();
  if (what.empty()) {
    what = a.task   ? std::vector<std::string>{"joints", "com", "contacts"}
           : motion ? std::vector<std::string>{"cost", "joints", "com", "contacts"}
                    : std::vector<std::string>{"cost"};  // numbers, or a family
  }
  if (!a.out.empty() && what.size() != 1) {
    throw InputError("--out FILE: needs one figure, chosen by --what");
  }
  std::optional<sim::Recording> recording;
  if (what != std::vector<std::string>{"cost"}) recording = practice::recordingOf(run, a.task);
  for (const std::string& w : what) {
    const fs::path file =
        a.out.empty() ? beside(a.run, suffix(a.task) + "-" + w + "." + a.format) : fs::path(a.out);
    const render::Figure figure = w == "cost"     ? render::costFigure(historyOf(run))
                                  : w == "joints" ? render::jointFigure(*recording)
                                  : w == "com"    ? render::comFigure(*recording)
                                                  : render::contactFigure(*recording);
    render::writeFigure(figure, file);
    print("{}\n", file.string());
  }
  return kDone;
}

}  // namespace

void requirePicture(const fs::path& file) {
  for (const char* known : {".png", ".mp4", ".glb", ".bvh"}) {
    if (file.extension() == known) return;
  }
  throw InputError(
      fmt::format("{}: expected a name ending in .png (film strip), .mp4 (video), "
                  ".glb (3D scene) or .bvh (skeleton)",
                  file.string()));
}

bool draw(const sim::Recording& recording, const fs::path& file, const DrawArguments& a,
          Interrupt& interrupt, bool quiet) {
  if (interrupt.asked()) return false;
  interrupt.release();
  const render::DrawOptions how{.contact_forces = a.forces, .com = a.com};
  if (file.extension() == ".png") {
    render::FilmStripOptions options{.times = a.times, .count = a.count, .columns = a.columns};
    options.draw = how;
    options.camera.view = a.view.empty() ? render::View::kSide : kViews.at(a.view);
    options.camera.follow = !a.still;
    if (!a.size.empty()) {
      options.panel_width = a.size[0];
      options.panel_height = a.size[1];
    }
    render::writePng(render::filmStrip(recording, options), file);
    return true;
  }
  if (file.extension() == ".glb" || file.extension() == ".bvh") {
    PendingFile out(file);
    out.write(file.extension() == ".glb" ? render::toGlb(recording)
                                         : clip::toBvh(clip::clipOf(recording)));
    out.commit();
    return true;
  }
  render::VideoOptions options;
  options.draw = how;
  options.speed = a.speed;
  options.camera.view = a.view.empty() ? render::View::kThreeQuarter : kViews.at(a.view);
  options.camera.follow = !a.still;
  if (!a.size.empty()) {
    options.width = a.size[0];
    options.height = a.size[1];
  }
  ProgressLine line("video", 100, 0, quiet);
  options.stop = interrupt.token();
  options.progress = [&](double done) {
    if (interrupt.asked()) throw Stopped();
    line.update(100 * done, "%", "%/s");
  };
  try {
    render::writeVideo(recording, file, options);
  } catch (const Stopped&) {
    return false;  // and no file is left
  } catch (const Process::GivenUp&) {
    return false;  // likewise
  }
  return true;
}

void addRender(CLI::App& program, int& exit_code) {
  auto a = std::make_shared<RenderArguments>();
  CLI::App* verb = program.add_subcommand(
      "render", "Draw a run's best trial: film strip, video, or for other programs.");
  verb->add_option("RUN", a->run, "Run file")->required();
  verb->add_option(
      "FILE", a->files,
      "Where to: .png for a film strip, .mp4 for a video, .glb for a moving 3D scene (glTF), .bvh "
      "for a moving skeleton; default: the first two, beside the run");
  verb->add_option("--task", a->task, "Of a family: which task, in the skill's own unit");
  verb->add_option("--view", a->view, "Default: a strip from the side, a video in between")
      ->check(CLI::IsMember({"side", "three-quarter", "front"}));
  verb->add_option("--times", a->times, "Film strip: these moments [s], comma separated")
      ->delimiter(',');
  verb->add_option("--count", a->count, "Film strip: so many telling moments")
      ->check(CLI::Range(1, 200))
      ->capture_default_str();
  verb->add_option("--columns", a->columns, "Film strip: panels in a row")
      ->check(CLI::Range(1, 200));
  verb->add_option("--size", a->size, "Panel or video size [px]: WIDTHxHEIGHT")
      ->delimiter('x')
      ->expected(2);
  verb->add_option("--speed", a->speed, "Video: 0.25 is four times slower than real")
      ->check(CLI::Range(0.01, 100.0))
      ->capture_default_str();
  verb->add_flag("--still", a->still, "Do not follow the robot");
  verb->add_flag("--forces", a->forces, "Draw contact forces");
  verb->add_flag("--com", a->com, "Mark the centre of mass");
  verb->add_flag("--quiet", a->quiet, "Print nothing but errors");
  verb->footer(
      "Examples:\n"
      "  traceur render runs/jump-0.05-seed1.run\n"
      "  traceur render runs/jump-0.05-seed1.run flight.png --times 0.7,0.8,0.9 --forces\n"
      "  traceur render runs/jump-0.05-seed1.run slow.mp4 --speed 0.25 --size 640x480\n"
      "  traceur render runs/jump-0.05-seed1.run jump.glb jump.bvh\n"
      "  traceur render runs/jump-family-seed1.run --task 0.06");
  verb->callback([a, &exit_code] { exit_code = renderRun(*a); });
}

void addPlot(CLI::App& program, int& exit_code) {
  auto a = std::make_shared<PlotArguments>();
  CLI::App* verb = program.add_subcommand(
      "plot", "Figures of a run: cost, joint angles, centre of mass, contact forces.");
  verb->add_option("RUN", a->run, "Run file")->required();
  verb->add_option("--task", a->task, "Of a family: which task's motion, in the skill's own unit");
  verb->add_option("--what", a->what,
                   "cost, joints, com, contacts; default: all, of a family its cost, of its task "
                   "the motion")
      ->delimiter(',')
      ->check(CLI::IsMember({"cost", "joints", "com", "contacts"}));
  verb->add_option("--format", a->format, "png or svg")
      ->check(CLI::IsMember({"png", "svg"}))
      ->capture_default_str();
  verb->add_option("--out", a->out, "File for the one figure of --what; default: beside the run");
  verb->footer(
      "Examples:\n"
      "  traceur plot runs/jump-0.05-seed1.run\n"
      "  traceur plot runs/jump-0.05-seed1.run --what cost --out cost.svg");
  verb->callback([a, &exit_code] { exit_code = plotRun(*a); });
}

}  // namespace traceur::cli
