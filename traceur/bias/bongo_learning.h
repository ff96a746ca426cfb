// The bongo board as a case of the loop: which hardware, which search, and what is learned from its
// logs [Ha2015, §8.5].
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <numbers>
#include <string>
#include <string_view>

#include "traceur/bias/balance.h"
#include "traceur/bias/bias_loop.h"
#include "traceur/bias/bongo_hardware.h"

namespace traceur::bias {

/// What is made of the logs.
enum class BongoMethod {
  kBias,       ///< the model's bias, and the noise of the readings
  kPublished,  ///< as printed: one-step differences, all six of them, no noise, no earlier torques
  kIdentify,   ///< a control: inertia, delay, friction and COM offset by least squares, and the
               ///< noise
  kRandomise,  ///< a control: nothing; the models have random faults (domain randomisation)
  kNone,       ///< a control: nothing; the model stays as it is
};

/// "bias", "published", "identify", "randomise", "none".
const std::vector<std::string>& bongoMethods();
/// @throws InputError with the names there are for one there is not
BongoMethod bongoMethod(std::string_view name);

/// How a policy is searched on a model.
enum class BongoSearch {
  kStarts,  ///< DIRECT until the board tilted by 0.25 degrees is balanced, then CMA-ES over seven
            ///< starts; begins where the last search ended
  kPublished,  ///< DIRECT alone, 1000 trials from 0.25 degrees [Ha2015, Tab. 12]
};

/// "starts", "published".
const std::vector<std::string>& bongoSearches();
/// @throws InputError as bongoMethod
BongoSearch bongoSearch(std::string_view name);

/// A simulated machine and where it begins.
struct BongoMachine {
  BongoFaults faults;
  /// α_w and α_b are uniform in ± this [rad]. The paper prints none. From two degrees most policies
  /// fail on their own model [ours].
  double start_angle = 0.5 * std::numbers::pi / 180;
};

/// A field of BongoFaults, and what it may be.
struct BongoFaultField {
  std::string_view name;  ///< "inertia_scale"
  double BongoFaults::*value;
  double least, most;
};
const std::array<BongoFaultField, 12>& bongoFaultFields();

/// Reads
///
///     start_angle = 0.5          # deg
///     [faults]
///     inertia_scale = 1.2        # and any other field of BongoFaults
///
/// Angles in degrees, the rest in BongoFaults' units; what is left out is without fault.
/// @throws InputError naming file, line and key
BongoMachine readBongoMachine(const std::filesystem::path& file);

struct BongoLearning {
  BongoParameters board;                            ///< of the model
  double start_angle = BongoMachine().start_angle;  ///< that the policy is to balance from [rad]
  BongoMethod method = BongoMethod::kBias;
  BongoSearch search = BongoSearch::kStarts;
  int iterations = 10;
  int runs = 2;
  std::uint64_t seed = 1;
};

/// @param angle  of the wheel and of the board [rad]; legs upright on it, at rest
BongoBoard::State bongoStart(double wheel_angle, double board_angle);

/// Learns on a simulated machine. The runs' noise and starts follow from the seed.
/// @param stop  asks it to end
BiasLearned learnOnMachine(const BongoMachine& machine, const BongoLearning& options,
                           const std::stop_token& stop = {});

BiasTask bongoTask(const BongoLearning& options);
ModelLearner bongoLearner(const BongoLearning& options);
BiasLoopOptions bongoLoop(const BongoLearning& options);
/// What a method that learns a bias learns it with. Samples that the noise of the readings makes
/// less certain than 1, the prior's standard deviation, tell no rate's bias: with such noise
/// kBias learns that of the torque, from windows as long as it takes.
/// @param noise  (6) variances, of the readings
BiasOptions bongoBias(BongoMethod method, const VectorXd& noise = VectorXd::Zero(6));
/// The same for certain logs: where a method heeds the readings' noise, with theirs.
BiasOptions bongoBias(BongoMethod method, const std::vector<RunLog>& logs,
                      const BongoParameters& board);

/// A data filter of [Ha2015, §8.3.3]: a sample with such a reading is not learned from. The paper
/// prints no thresholds; those without a word on their source are its experiments'.
struct BongoFilter {
  std::string_view name;
  double threshold;  ///< NaN: not judged
  std::string_view unit;
};
/// The seven, in the paper's order:
///
///     1  board on the ground     0.005 m, its lower end below it [ours]
///     2  board and wheel apart   not judged: a state does not tell
///     3  distance                4.5 rad, |α_w| + |α_b| + |θ| above it
///     4  body angle              0.7 rad, of the legs from the vertical; an episode ends at 0.5
///     5  board angle             0.3 rad, from the horizontal [ours: as an episode ends]
///     6  rate                    6.2 rad/s, of wheel, board or both [ours: as an episode ends]
///     7  prediction              1, from where the model goes in a step, in rad and 10 rad/s
///
/// 7 needs the reading before and is left to BiasOptions::outlier.
const std::array<BongoFilter, 7>& bongoFilters();
/// The first filter, as an index, that is against a reading; -1 for none of 1 to 6.
int bongoFilter(const BongoParameters& board, const VectorXd& x);
/// Whether a reading is of use to learn from: no filter is against it.
std::function<bool(const VectorXd& x)> bongoKeeps(const BongoParameters& board);

/// What can be learned from logs, and how many samples each filter is against.
struct BongoSamples {
  std::vector<BiasSample> kept;
  std::array<int, 7> left_out{};  ///< by bongoFilters()
};
BongoSamples bongoSamples(const std::vector<RunLog>& logs, const BongoParameters& board,
                          const BiasOptions& options);

/// A run that was seen, as balance() would have counted it. One that ends early without a failure
/// was cut short: its failure is "end of the log".
Episode episodeOf(const RunLog& log, const BongoParameters& board, const BalanceCost& cost = {},
                  const BalanceLimits& limits = {});

/// A run of the machine from the start that (seed, number) draws.
PlantRun runMachine(const BongoMachine& machine, const BongoParameters& board,
                    const VectorXd& parameters, std::uint64_t seed, int number);

/// Of `count` random starts, how many a policy balances from for five seconds; of those before the
/// stop was asked for.
int successes(const BongoMachine& machine, const BongoParameters& board, const VectorXd& parameters,
              int count, std::uint64_t seed, const std::stop_token& stop = {});

}  // namespace traceur::bias
