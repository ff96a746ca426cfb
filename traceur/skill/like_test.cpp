#include <gtest/gtest.h>

#include <fstream>

#include "traceur/core/test_folder.h"
#include "traceur/skill/skill_testing.h"

namespace traceur::skill {
namespace {

constexpr const char* kHop = R"(
name = "hop"
robot = "bioloid-gp"
horizon = 1
[conditions]
high = { range = [0, 1], default = 0.1, draw = [0.2, 0.3] }
[constants]
lean = 0.1
[parameters]
bend = { unit = "rad", range = [0, 1], initial = 0.4 }
way = { range = [-1, 1], initial = 0.2 }
[controller]
kp = 20
kd = 1
[[phase]]
name = "crouch"
pose = { base = "stand", shin = "bend + lean" }
[[objective]]
name = "all"
cost = "way"
)";

/// A folder in which hop.toml is.
class Like : public testing::Test {
 protected:
  Like() { write("hop.toml", kHop); }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  std::shared_ptr<const Skill> read(const std::string& text) const {
    return Skill::fromText(text, folder_ / "own.toml");
  }
  std::string wrong(const std::string& text) const {
    try {
      read(text);
    } catch (const InputError& e) {
      return e.what();
    }
    return "accepted";
  }

 private:
  TestFolder folder_;
};

TEST_F(Like, IsTheOtherOneButForWhatItSays) {
  const auto own = read(
      "like = \"hop.toml\"\nname = \"high hop\"\n[parameters]\nbend = 0.7\n"
      "[conditions]\nhigh = 0.6\n[controller]\nkp = 30\n[constants]\nlean = 0.2\n");
  EXPECT_EQ(own->name, "high hop");
  EXPECT_EQ(own->horizon, 1);
  ASSERT_EQ(own->parameters.size(), 2U);
  EXPECT_EQ(own->parameters[0].name, "bend");  // in the other's order
  EXPECT_EQ(own->parameters[0].initial, 0.7);
  EXPECT_EQ(own->parameters[0].max, 1);
  EXPECT_EQ(own->parameters[1].initial, 0.2);
  EXPECT_EQ(own->conditions[0].initial, 0.6);
  EXPECT_EQ(own->drawn[0], std::pair(0.2, 0.3));
  EXPECT_EQ(own->controller.joints[0].kp, 30);
  EXPECT_EQ(own->controller.joints[0].kd, 1);
  EXPECT_EQ(own->constants[0].second, 0.2);
  EXPECT_EQ(own->phases.size(), 1U);
  EXPECT_EQ(own->like, std::string(kHop) + "\n");
}

TEST_F(Like, MayBeLikeOneThatIsLikeAnother) {
  write("low.toml", "like = \"hop.toml\"\n[parameters]\nbend = 0.1\nway = 0.9\n");
  const auto own =
      read("like = \"low.toml\"\n[parameters]\nbend = { range = [0, 2], initial = 1.5 }");
  EXPECT_EQ(own->parameters[0].initial, 1.5);
  EXPECT_EQ(own->parameters[1].initial, 0.9);
}

TEST_F(Like, SaysWhichFileAMistakeIsIn) {
  write("hop.toml", std::string(kHop) + "[[failure]]\nname = \"fell\"\nwhen = \"nothing > 1\"\n");
  const std::string both = wrong("like = \"hop.toml\"\n[parameters]\nbend = 7\n");
  EXPECT_NE(both.find("own.toml:3:"), std::string::npos) << both;
  EXPECT_NE(both.find("hop.toml:23:"), std::string::npos) << both;
}

TEST_F(Like, TakesPhasesAndNamesAsTheyAre) {
  EXPECT_NE(wrong("like = \"hop.toml\"\n[[phase]]\nname = \"more\"\n").find("own.toml:2:"),
            std::string::npos);
  const std::string unknown = wrong("like = \"hop.toml\"\n[parameters]\nbent = 0.7\n");
  EXPECT_NE(unknown.find("\"bent\": the skill that this one is like has none"), std::string::npos)
      << unknown;
}

TEST_F(Like, EndsWhereFilesAreLikeEachOther) {
  write("a.toml", "like = \"b.toml\"\n");
  write("b.toml", "like = \"a.toml\"\n");
  EXPECT_NE(wrong("like = \"a.toml\"\n").find("is like itself"), std::string::npos);
  EXPECT_NE(wrong("like = \"own.toml\"\n").find("is like itself"), std::string::npos);
  EXPECT_NE(wrong("like = \"none.toml\"\n").find("own.toml:1:8: \"like\""), std::string::npos);
  EXPECT_NE(wrong("like = 3\n").find("expected the path of a skill file"), std::string::npos);
}

}  // namespace
}  // namespace traceur::skill
