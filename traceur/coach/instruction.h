// What a coach says of a motion: one instruction, understood.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "traceur/sim/model.h"

namespace traceur::coach {

using Eigen::Vector3d;

/// The twelve forms of an instruction [Ha2015, Table 6].
enum class Form {
  kFlex,       ///< FLEX|EXTEND joint BY angle
  kMove,       ///< MOVE direction BY distance
  kTranslate,  ///< TRANSLATE limb direction BY distance
  kRotate,     ///< ROTATE limb axis BY angle
  kSpeed,      ///< SPEED NEAR velocity
  kMomentum,   ///< SPEEDUP|SLOWDOWN percent
  kTurn,       ///< TURNFASTER|TURNSLOWER percent
  kBalance,    ///< BALANCE
  kStiffness,  ///< RELAX|STIFFEN joint BY percent
  kPush,       ///< PUSH|PULL limb AGAINST surface
  kPlace,      ///< PLACE thing NEAR thing|place
  kRelation,   ///< thing IN FRONT OF thing|place, spin about z FORWARD
};

/// What an instruction is about, by the robot's own names.
struct Thing {
  enum class Kind {
    kCom,
    kCop,
    kBody,      ///< a body or a group of bodies; a group counts as the mean of its members
    kJoints,    ///< joints, pairs, or all joints of a limb
    kSpin,      ///< the whole body's angular velocity about an axis
    kAttitude,  ///< a body's angle about an axis
    kPlace,     ///< a fixed place
    kNumber,    ///< what a spin [rad/s] or an attitude [rad] is held against
  };
  Kind kind = Kind::kCom;
  std::string name;  ///< as the robot's file has it; kJoints: see joints
  /// kBody without a name: the mean of these.
  std::vector<std::string> bodies;
  std::vector<std::string> joints;     ///< pairs or joints, as robot.toml names them
  Vector3d vector = Vector3d::Zero();  ///< kPlace: world axes [m]; kSpin, kAttitude: axis
  double number = 0;                   ///< kNumber
  std::string said;                    ///< as the person called it
};

/// Where a thing is to be, as the athlete sees it.
enum class Relation {
  kNone,
  kInFrontOf,
  kBehind,
  kAbove,
  kBelow,
  kLeftOf,
  kRightOf,
  kGreater,
  kLess
};

/// One instruction. World axes are x forward, y left, z up, whatever the script's are.
struct Instruction {
  Form form = Form::kBalance;
  std::optional<Thing> subject, other;
  Vector3d direction = Vector3d::Zero();  ///< unit vector, world axes; of kRotate the axis
  std::string direction_name;             ///< "upward", "x-axis"
  /// [m] or [rad]; of kMomentum, kTurn and kStiffness the factor on what was before.
  double amount = 0;
  Vector3d velocity = Vector3d::Zero();  ///< kSpeed, world axes [m/s]
  Relation relation = Relation::kNone;
  bool relative = false;     ///< of kFlex: the amount is from what it was, not from straight
  int line = 0, column = 0;  ///< of the script, from 1; 0: of none
  std::string said;          ///< as it was written
  std::string means;         ///< the form it was understood as: "MOVE downward BY 0.2 m"
};

/// The axes in which a script writes vectors.
enum class Axes {
  kPublished,  ///< x forward, y up, z to the right [Ha2015, §5]
  kWorld,      ///< x forward, y left, z up
};
Vector3d toWorld(const Vector3d& written, Axes axes);

/// How percentages are read.
enum class Readings {
  kOurs,     ///< "SLOWDOWN 20%", "RELAX arms BY 30%": by so much less; "TURNSLOWER 70%": to so much
  kLiteral,  ///< always to so much, as the printed formulas have it
};

/// Why a text is no instruction.
struct Misunderstanding {
  int column = 1;  ///< in the text, from 1
  std::string reason;
};

/// Understands instructions for one robot: the printed forms and plain English that means the same.
/// Every word must be understood; nothing is guessed past a word that is not known.
class Interpreter {
 public:
  /// @param surfaces  names of what is around it, besides "floor" and "ground"
  Interpreter(const sim::Model& model, Axes axes, Readings readings,
              std::vector<std::string> surfaces)
      : model_(&model), axes_(axes), readings_(readings), surfaces_(std::move(surfaces)) {}

  /// @throws Misunderstanding
  Instruction understand(const std::string& text) const;

  /// A thing by a person's name for it: "head", "elbows", "left hand", "COM".
  std::optional<Thing> thing(std::string_view words) const;
  /// The bodies that these joints or pairs move: their frames stand at the joints.
  std::vector<std::string> bodiesOf(const std::vector<std::string>& joints) const;
  /// The pairs and joints a person's word means: "elbows", "arms", "hips".
  std::vector<std::string> jointsOf(std::string_view words) const;

 private:
  std::vector<std::string> vocabulary() const;

  const sim::Model* model_;
  Axes axes_;
  Readings readings_;
  std::vector<std::string> surfaces_;
};

/// The axis a script calls x, y or z.
Vector3d axisNamed(char letter, Axes axes);

/// Small pieces of a line: a word in lower case, a number with its unit, a vector, a percentage.
struct Token {
  enum class Kind { kWord, kNumber, kVector, kPercent } kind = Kind::kWord;
  std::string word;   ///< kWord: in lower case; kNumber: its unit, "" for none
  double number = 0;  ///< SI: degrees are radians
  Vector3d vector = Vector3d::Zero();
  int column = 1;  ///< from 1
};
/// @throws Misunderstanding
std::vector<Token> tokensOf(const std::string& text);

}  // namespace traceur::coach
