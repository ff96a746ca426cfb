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
    balance(board, {}, BalancePolicy::of(VectorXd::Ones(5)), x0, {.steps = 20}, {}, &written);
    writeLog(good(), written, bongoLogFormat());
  }

  fs::path good() const { return folder / "good.csv"; }
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
    std::ofstream(folder / "bad.csv") << changed;
    try {
      readLog(folder / "bad.csv", bongoLogFormat());
    } catch (const InputError& e) {
      return e.what();
    }
    return "accepted";
  }

  TestFolder folder;
  RunLog written;
};

TEST_F(LogFile, ComesBackBitByBit) {
  ASSERT_EQ(written.steps(), 20);
  const RunLog again = readLog(good(), bongoLogFormat());
  EXPECT_EQ(again.time_step, written.time_step);
  EXPECT_EQ(again.x, written.x);
  EXPECT_EQ(again.u, written.u);
}

TEST_F(LogFile, MayHaveOtherColumnsInAnyOrderAndAnInputToTheLastReading) {
  std::ofstream(folder / "other.csv")
      << "# {\"format\": \"traceur log\", \"version\": 1, \"plant\": \"cart\", \"time_step\": 0.5, "
         "\"units\": {\"time\": \"s\", \"x\": \"m\", \"u\": \"N\"}}\r\n"
         "u,note,time,x\r\n1,a,10,2\r\n3,b,10.5,4\r\n";
  const RunLog log = readLog(folder / "other.csv", {"cart", {{"x", "m"}}, {{"u", "N"}}});
  ASSERT_EQ(log.steps(), 1);
  EXPECT_EQ(log.u(0, 0), 1);
  EXPECT_EQ(log.x(0, 0), 2);
  EXPECT_EQ(log.x(0, 1), 4);
}

/// Of a plant with two states and two inputs, so that none is taken for another.
TEST_F(LogFile, RowsOfCellsAreReadOrRefusedByTheirPlaces) {
  const LogFormat format{"cart", {{"x", "m"}, {"v", "m/s"}}, {{"u", "N"}, {"w", "V"}}};
  const auto said = [&](const std::string& rows) -> std::string {
    std::ofstream(folder / "cart.csv")
        << "# {\"format\": \"traceur log\", \"version\": 1, \"plant\": \"cart\", "
           "\"time_step\": 0.5, \"units\": {\"time\": \"s\", \"x\": \"m\", \"v\": "
           "\"m/s\", \"u\": \"N\", \"w\": \"V\"}}\ntime,x,v,u,w\n"
        << rows;
    try {
      const RunLog log = readLog(folder / "cart.csv", format);
      std::stringstream out;
      out << "x";
      for (const double x : log.x.reshaped()) out << ' ' << x;
      out << " u";
      for (const double u : log.u.reshaped()) out << ' ' << u;
      return out.str();
    } catch (const InputError& e) {
      return e.what();
    }
  };
  const auto says = [&](const std::string& rows, const std::string& words) {
    EXPECT_NE(said(rows).find(words), std::string::npos) << said(rows);
  };
  says("0,1,2,3,4\n.5,5,6,7,8\n1,9,10,,\n", "x 1 2 5 6 9 10 u 3 4 7 8");
  says("0,1,2,3,4\n.5,5,6,7,8\n1,9,10,11,12\n", "u 3 4 7 8");  // the last one's answer nothing
  says("0,1,2,3,4\n\n.5,5,6", "x 1 2 5 6 u 3 4");
  says("0,1,2,3,4\n.5,5,6,,\n1,9,10,,\n", "cart.csv:5: a row after one without an input");
  says("0,1,2,3,4\n.5,5,6,,8\n1,9,10,,\n", "cart.csv:5: a row after one without an input");
  says("0,1,,3,4\n.5,5,6,7,8\n", "cart.csv:3: \"v\": expected a finite number, got \"\"");
  says("0,1,two,3,4\n.5,5,6,7,8\n", "\"v\": expected a finite number, got \"two\"");
  says("0,1,2,three,4\n.5,5,6,7,8\n", "\"u\": expected a finite number, got \"three\"");
  says("0,1,2,3,4\n", "cart.csv:3: 1 readings: expected at least two");
  says("", "cart.csv:2: 0 readings");
  for (const char* near : {"0.4951", "0.5049"}) {  // a hundredth of a step
    says("0,1,2,3,4\n" + std::string(near) + ",5,6,7,8\n", "x 1");
  }
  for (const char* far : {"0.4949", "0.5051", "-0.5", "0"}) {
    says("0,1,2,3,4\n" + std::string(far) + ",5,6,7,8\n", "expected a step of 0.5 s");
  }
}

TEST_F(LogFile, WritesAnInputBesideTheReadingItAnswers) {
  RunLog log{0.5, MatrixXd(1, 3), MatrixXd(2, 2)};
  log.x << 1, 2, 3;
  log.u << 4, 5, 6, 7;
  writeLog(folder / "cart.csv", log, {"cart", {{"x", "m"}}, {{"u", "N"}, {"w", "V"}}});
  EXPECT_EQ(text(folder / "cart.csv"),
            "# {\"format\":\"traceur log\",\"version\":1,\"plant\":\"cart\",\"time_step\":0.5,"
            "\"units\":{\"time\":\"s\",\"x\":\"m\",\"u\":\"N\",\"w\":\"V\"}}\n"
            "time,x,u,w\n0,1,4,6\n0.5,2,5,7\n1,3,,\n");
}

TEST_F(LogFile, MayHaveAThousandColumns) {
  for (const int more : {992, 993}) {
    std::stringstream lines(text(good()));
    std::ofstream out(folder / "wide.csv");
    std::string line;
    for (int i = 0; std::getline(lines, line); ++i) {
      out << line;
      if (i == 1) {
        for (int k = 0; k < more; ++k) out << ",more" << k;
      }
      out << '\n';
    }
    out.close();
    if (more == 992) {
      EXPECT_EQ(readLog(folder / "wide.csv", bongoLogFormat()).u, written.u);
    } else {
      EXPECT_THROW(readLog(folder / "wide.csv", bongoLogFormat()), InputError);
    }
  }
}

TEST_F(LogFile, MayBeginWithAByteOrderMark) {
  std::ofstream(folder / "marked.csv") << "\xEF\xBB\xBF" << text(good());
  EXPECT_EQ(readLog(folder / "marked.csv", bongoLogFormat()).x, written.x);
}

TEST_F(LogFile, RefusesFilesOfOneLine) {
  const std::string header = text(good()).substr(0, text(good()).find('\n'));
  for (const std::string& only : {header, header + "\n", std::string(), std::string("\n")}) {
    std::ofstream(folder / "one.csv") << only;
    EXPECT_THROW(readLog(folder / "one.csv", bongoLogFormat()), InputError) << only;
    try {
      readLog(folder / "one.csv", bongoLogFormat());
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find("one.csv:1: expected"), std::string::npos) << e.what();
    }
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
  says("# {", "# ", "bad.csv:1: the first line is not the header of a log");
  says("\"time\":\"s\"", "\"time\":\"ms\"", "\"time\" is in \"ms\", expected \"s\"");
  says("\"torque\":\"N·m\"", "\"torque\":\"Nm\"", "\"torque\" is in \"Nm\"");
  for (const char* step : {"0", "-0.001"}) {
    says("\"time_step\":0.001", "\"time_step\":" + std::string(step), "expected seconds > 0");
  }
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
  std::ofstream(folder / "short.csv") << text(good()).substr(0, text(good()).find("\n0.001"));
  EXPECT_THROW(readLog(folder / "short.csv", bongoLogFormat()), InputError);
  EXPECT_THROW(readLog(folder / "none.csv", bongoLogFormat()), std::exception);
}

}  // namespace
}  // namespace traceur::bias
