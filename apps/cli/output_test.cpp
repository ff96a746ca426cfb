#include "apps/cli/output.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "apps/cli/csv.h"

namespace traceur::cli {
namespace {

template <class Write>
std::string printed(Write write) {
  testing::internal::CaptureStdout();
  write();
  flushResults();
  return testing::internal::GetCapturedStdout();
}

template <class Write>
std::string noted(Write write) {
  testing::internal::CaptureStderr();
  write();
  return testing::internal::GetCapturedStderr();
}

TEST(Output, OurLinesStayAndThoseOfNamesAreShown) {
  const std::string name = "a\nb\x1b[2J";
  EXPECT_EQ(printed([&] { print("{}:\n{:>8.3f} {:<4}|\n", name, 0.5, "x"); }),
            "a\\nb\\x1b[2J:\n   0.500 x   |\n");
  EXPECT_EQ(noted([&] { note("{} {}\n", name, std::string_view("\xff")); }),
            "a\\nb\\x1b[2J \\xff\n");
}

TEST(Output, AComplaintCannotBeForgedByAName) {
  EXPECT_EQ(noted([] { complain("x.toml:1:1: no \"\x1b\"\nx.toml:2:1: no y\n  asked: 1"); }),
            "traceur: x.toml:1:1: no \"\\x1b\"\n  x.toml:2:1: no y\n  asked: 1\n");
  EXPECT_EQ(noted([] { complain("no skill \"a\ntraceur: all is well\""); }),
            "traceur: no skill \"a\n  traceur: all is well\"\n");
}

TEST(Output, ANoteTakesTheProgressLinesPlace) {
  EXPECT_EQ(noted([] {
              writeLine("1/9");
              note("still waiting\n");
              writeLine("2/9");
              endLine();
              endLine();
            }),
            "\r\033[K1/9\r\033[Kstill waiting\n\r\033[K2/9\n");
}

TEST(Output, JsonIsHarmlessAndStillJson) {
  const std::string name = "\x1b[1m\n\x7f\u009b\u202e \u2028 Hüfte \"\\x\"";
  const nlohmann::json json = {{name, name}};
  const std::string text = jsonText(json);
  EXPECT_EQ(text,
            "{\n  \"\\u001b[1m\\n\\u007f\\u009b\\u202e \\u2028 Hüfte \\\"\\\\x\\\"\": "
            "\"\\u001b[1m\\n\\u007f\\u009b\\u202e \\u2028 Hüfte \\\"\\\\x\\\"\"\n}");
  EXPECT_EQ(nlohmann::json::parse(text), json);
}

TEST(Output, JsonOfBytesThatAreNotUtf8) {
  EXPECT_EQ(jsonText(nlohmann::json{{"a", "x\xff"}}, -1), "{\"a\":\"x\uFFFD\"}");
}

TEST(CsvField, IsOneFieldOfOneLine) {
  EXPECT_EQ(csvField("thrust"), "thrust");
  EXPECT_EQ(csvField("raise, both"), "\"raise, both\"");
  EXPECT_EQ(csvField("\"a\"\nb\r\x1b"), "\"\"\"a\"\"\\nb\\r\\x1b\"");
}

}  // namespace
}  // namespace traceur::cli
