#include "traceur/bias/run_log_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "traceur/bias/balance.h"
#include "traceur/core/error.h"
#include "traceur/core/test_folder.h"

namespace traceur::bias {
namespace {

namespace fs = std::filesystem;

class LogFile : public testing::Test {
 protected:
  LogFile() {
    VectorXd x0 = VectorXd::Zero(6);
    x0[1] = 0.02;
    BongoBoard board;
    balance(board, {}, BalancePolicy::of(VectorXd::Ones(5)), x0, {.steps = 20}, {}, &log_);
    writeLog(good(), log_, bongoLogFormat());
  }

  fs::path good() const { return dir_ / "good.csv"; }
  static std::string text(const fs::path& file) {
    std::stringstream s;
    s << std::ifstream(file).rdbuf();
    return s.str();
  }
  /// What is said of the good log with one thing replaced in it.
  std::string complaint(const std::string& from, const std::string& to) const {
    std::string changed = text(good());
    const size_t at = changed.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    changed.replace(at, from.size(), to);
    std::ofstream(dir_ / "bad.csv") << changed;
    try {
      readLog(dir_ / "bad.csv", bongoLogFormat());
    } catch (const InputError& e) {
      return e.what();
    }
    return "accepted";
  }

  TestFolder dir_;
  RunLog log_;
};

TEST_F(LogFile, ComesBackBitByBit) {
  ASSERT_EQ(log_.steps(), 20);
  const RunLog again = readLog(good(), bongoLogFormat());
  EXPECT_EQ(again.time_step, log_.time_step);
  EXPECT_EQ(again.x, log_.x);
  EXPECT_EQ(again.u, log_.u);
}

TEST_F(LogFile, MayHaveOtherColumnsInAnyOrderAndAnInputToTheLastReading) {
  std::ofstream(dir_ / "other.csv")
      << "# {\"format\": \"traceur log\", \"version\": 1, \"plant\": \"cart\", \"time_step\": 0.5, "
         "\"units\": {\"time\": \"s\", \"x\": \"m\", \"u\": \"N\"}}\r\n"
         "u,note,time,x\r\n1,a,10,2\r\n3,b,10.5,4\r\n";
  const RunLog log = readLog(dir_ / "other.csv", {"cart", {{"x", "m"}}, {{"u", "N"}}});
  ASSERT_EQ(log.steps(), 1);
  EXPECT_EQ(log.u(0, 0), 1);
  EXPECT_EQ(log.x(0, 1), 4);
}

TEST_F(LogFile, MayBeginWithAByteOrderMark) {
  std::ofstream(dir_ / "marked.csv") << "\xEF\xBB\xBF" << text(good());
  EXPECT_EQ(readLog(dir_ / "marked.csv", bongoLogFormat()).x, log_.x);
}

TEST_F(LogFile, RefusesFilesOfOneLine) {
  const std::string header = text(good()).substr(0, text(good()).find('\n'));
  for (const std::string& only : {header, header + "\n", std::string(), std::string("\n")}) {
    std::ofstream(dir_ / "one.csv") << only;
    EXPECT_THROW(readLog(dir_ / "one.csv", bongoLogFormat()), InputError) << only;
  }
}

TEST_F(LogFile, RefusesWhatIsWrongByLineAndColumn) {
  const auto says = [&](const std::string& from, const std::string& to, const std::string& words) {
    const std::string said = complaint(from, to);
    EXPECT_NE(said.find(words), std::string::npos) << said;
    EXPECT_NE(said.find("bad.csv:"), std::string::npos) << said;
  };
  says("traceur log", "another log", "expected \"traceur log\"");
  says("\"version\":1", "\"version\":2", "version 2");
  says("bongo board", "unicycle", "a log of the plant \"unicycle\"");
  says("\"leg\":\"rad\"", "\"leg\":\"deg\"", "\"leg\" is in \"deg\", expected \"rad\"");
  says("time,wheel,", "time,wheels,", "no column \"wheel\"");
  says("# {", "{", "bad.csv:1");
  says("\n0.001,", "\n0.001,nan", "finite number");
  says("\n0.001,", "\n0.001,inf", "finite number");
  says("\n0.001,", "\n0.001,1e999", "finite number");
  says("\n0.001,", "\n0.001,,", "cells, expected 8");
  says("board,", "wheel,", "two columns \"wheel\"");
  says("time,wheel", "time,time,wheel", "two columns \"time\"");
  says("time,wheel", "\ntime,wheel", "names of the columns");
  says("time,wheel", "time,wheel" + std::string(2'000'000, ','), "columns: expected 1000 at most");
  says("\n0.001,", "\n0.001," + std::string(2'000'000, ','), "cells, expected 8");
  says("\n0.002,", "\n0.0005,", "expected a step of 0.001 s");
  says("\n0.002,", "\n0.003,", "expected a step of 0.001 s");
  EXPECT_NE(complaint("\n0.002,", "\n0.0005,").find("bad.csv:5"), std::string::npos);
  std::ofstream(dir_ / "short.csv") << text(good()).substr(0, text(good()).find("\n0.001"));
  EXPECT_THROW(readLog(dir_ / "short.csv", bongoLogFormat()), InputError);
  EXPECT_THROW(readLog(dir_ / "none.csv", bongoLogFormat()), std::exception);
}

}  // namespace
}  // namespace traceur::bias
