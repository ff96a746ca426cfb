#include "traceur/bias/policy_file.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "traceur/bias/bongo_learning.h"
#include "traceur/core/error.h"
#include "traceur/core/test_folder.h"

namespace traceur::bias {
namespace {

class PolicyFile : public testing::Test {
 protected:
  TestFolder folder;
};

VectorXd parameters() {
  VectorXd p(5);
  p << 6.8, 2.4, -5.0, -1.1, 3.9;
  return p;
}

TEST_F(PolicyFile, KeepsEveryBit) {
  writePolicy(folder / "p.json", parameters());
  EXPECT_EQ(readPolicy(folder / "p.json"), parameters());
}

TEST_F(PolicyFile, RefusesWhatIsNone) {
  const auto message_of = [&](const std::string& text) -> std::string {
    std::ofstream(folder / "p.json") << text;
    try {
      readPolicy(folder / "p.json");
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  const std::string head = R"({"format": "traceur policy", "version": 1, "plant": "bongo board")";
  EXPECT_NE(message_of("hello").find("p.json"), std::string::npos);
  EXPECT_NE(message_of("{}").find("traceur policy"), std::string::npos);
  EXPECT_NE(message_of(head + "}").find("parameters"), std::string::npos);
  EXPECT_NE(message_of(head + R"(, "parameters": [1, 2]})").find("expected 5"), std::string::npos);
  EXPECT_NE(message_of(head + R"(, "parameters": [1, 2, 3, 4, 50]})").find("up to 10"),
            std::string::npos);
  EXPECT_THROW(readPolicy(folder / "none.json"), InputError);
  const std::string five = R"(, "parameters": [1, -10, 3, 4, 10]})";
  EXPECT_EQ(message_of(head + five), "");  // the bounds themselves are within
  for (const char* four : {"[1, 2, 3, 4]", "[1, 2, 3, 4, 5, 6]"}) {
    EXPECT_NE(message_of(head + R"(, "parameters": )" + four + "}").find("expected 5"),
              std::string::npos);
  }
  for (const char* beyond : {"10.001, 2, 3, 4, 5", "1, 2, 3, 4, -10.001"}) {
    EXPECT_NE(message_of(head + R"(, "parameters": [)" + beyond + "]}").find("up to 10"),
              std::string::npos);
  }
  EXPECT_NE(message_of(head + R"(, "parameters": [1, 2, 3, 4, "5"]})").find("not a policy"),
            std::string::npos);
  const auto other = [&](const std::string& from, const std::string& to) {
    std::string changed = head;
    changed.replace(changed.find(from), from.size(), to);
    return message_of(changed + five);
  };
  EXPECT_NE(other("traceur policy", "policy").find("\"traceur policy\""), std::string::npos);
  EXPECT_NE(other("\"version\": 1", "\"version\": 2").find("\"version\""), std::string::npos);
  EXPECT_NE(other("\"version\": 1", "\"versions\": 1").find("\"version\""), std::string::npos);
  EXPECT_NE(other("bongo board", "unicycle").find("\"plant\""), std::string::npos);
}

TEST_F(PolicyFile, TellsPeopleItsGains) {
  VectorXd p(5);
  for (int i = 0; i < 5; ++i) p[i] = std::log(2 + i);  // gains of 1 to 5
  writePolicy(folder / "p.json", p);
  std::stringstream text;
  text << std::ifstream(folder / "p.json").rdbuf();
  const std::string json = text.str();
  EXPECT_TRUE(json.starts_with("{\n  \"format\": \"traceur policy\",\n  \"version\": 1,\n"));
  size_t at = json.find("\"gains\"");
  const char* const names[] = {"place", "speed", "leg", "leg_rate", "board_angle"};
  const char* const units[] = {"N", "N·s", "N·m/rad", "N·m·s/rad", "N·m/rad"};
  for (int i = 0; i < 5; ++i) {
    at = json.find('"' + std::string(names[i]) + "\": {", at);
    ASSERT_NE(at, std::string::npos) << names[i];
    at = json.find("\"value\": ", at);
    EXPECT_NEAR(std::stod(json.substr(at + 9)), i + 1, 1e-12) << names[i];
    at = json.find("\"unit\": ", at);
    EXPECT_EQ(json.substr(at + 9, json.find('"', at + 9) - at - 9), units[i]);
  }
  at = json.find("\"most_torque\"");
  EXPECT_EQ(std::stod(json.substr(json.find("\"value\": ", at) + 9)), 100);
}

/// What a C compiler makes of the header asks for the same torque as the policy.
TEST_F(PolicyFile, TheHeaderComputesTheSameTorque) {
  std::ofstream(folder / "policy.h") << cHeader(parameters());
  std::ofstream(folder / "main.c") << R"(#include <stdio.h>
#include "policy.h"
int main(void) {
  float x[6];
  while (scanf("%f %f %f %f %f %f", x, x + 1, x + 2, x + 3, x + 4, x + 5) == 6)
    printf("%.9g\n", traceur_bongo_torque(x[0], x[1], x[2], x[3], x[4], x[5]));
  return 0;
}
)";
  std::ofstream readings(folder / "x.txt");
  const BalancePolicy policy = BalancePolicy::of(parameters());
  std::vector<double> expected;
  for (int i = 0; i < 40; ++i) {
    BongoBoard::State x;
    // The last ones ask for more than there is.
    const double size = i < 30 ? 1 : 8;
    for (int j = 0; j < 6; ++j) x[j] = size * (j < 3 ? 0.05 : 0.1) * std::sin(1.7 * i + j);
    for (int j = 0; j < 6; ++j) readings << x[j] << (j < 5 ? " " : "\n");
    expected.push_back(policy.torque({}, x));
  }
  readings << "nan 0 0 0 0 0\n";
  expected.push_back(0);
  readings.close();
  const std::string in = folder.path().string();
  ASSERT_EQ(std::system(("cc -Wall -Werror -o " + in + "/a.out " + in + "/main.c -lm && " + in +
                         "/a.out < " + in + "/x.txt > " + in + "/u.txt")
                            .c_str()),
            0);
  std::ifstream torques(folder / "u.txt");
  for (const double u : expected) {
    double got = 0;
    ASSERT_TRUE(torques >> got);
    EXPECT_NEAR(got, u, 0.01);
  }
}

}  // namespace
}  // namespace traceur::bias
