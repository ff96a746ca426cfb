#include "traceur/optim/state.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "traceur/core/error.h"
#include "traceur/optim/test_numbers.h"

namespace traceur::optim {
namespace {

std::string sample() {
  StateWriter w("thing", 3);
  w.integer(42);
  w.real(-0.0);
  w.real(std::numeric_limits<double>::denorm_min());
  w.reals(std::vector<double>{1.5, NAN, kInf});
  w.text("why");
  return w.finish();
}

TEST(State, GivesBackEveryBit) {
  const std::string bytes = sample();
  StateReader r(bytes, "thing", 3);
  EXPECT_EQ(r.integer(), 42);
  double number = 0;
  r.real(number);
  EXPECT_TRUE(std::signbit(number));
  r.real(number);
  EXPECT_EQ(number, std::numeric_limits<double>::denorm_min());
  std::vector<double> reals;
  r.reals(reals);
  ASSERT_EQ(reals.size(), 3);
  EXPECT_EQ(reals[0], 1.5);
  EXPECT_TRUE(std::isnan(reals[1]));
  EXPECT_EQ(reals[2], kInf);
  std::string text;
  r.text(text);
  EXPECT_EQ(text, "why");
  EXPECT_NO_THROW(r.finish());
}

struct Thing {
  int count = 0;
  bool flag = false;
  std::optional<double> maybe;
  std::vector<double> some;
};
template <class IO, class Fields>
void fieldsOfThing(IO& io, Fields& thing) {
  io.integer(thing.count, 1, 9);
  io.boolean(thing.flag);
  io.optional(thing.maybe, [&](auto& value) { io.finite(value); });
  io.list(thing.some, 0, 3, [&](auto& value) { io.positive(value); });
  io.require(thing.some.size() < 3, "it has too many");
}

TEST(State, ReadsByTheListThatItIsWrittenBy) {
  const auto saved = [](const Thing& thing) {
    StateWriter w("thing", 1);
    fieldsOfThing(w, thing);
    return w.finish();
  };
  const auto restored = [](const std::string& bytes) {
    Thing thing{.maybe = 7, .some = {8, 8}};  // of before; nothing of it stays
    StateReader r(bytes, "thing", 1);
    fieldsOfThing(r, thing);
    r.finish();
    return thing;
  };
  for (const Thing& thing : {Thing{9, true, 0.5, {1, 2}}, Thing{1, false, std::nullopt, {}}}) {
    const Thing other = restored(saved(thing));
    EXPECT_EQ(other.count, thing.count);
    EXPECT_EQ(other.flag, thing.flag);
    EXPECT_EQ(other.maybe, thing.maybe);
    EXPECT_EQ(other.some, thing.some);
  }
  EXPECT_THROW(restored(saved({10, true, std::nullopt, {}})), InputError);
  EXPECT_THROW(restored(saved({9, true, NAN, {}})), InputError);
  EXPECT_THROW(restored(saved({9, true, 1, {0}})), InputError);
  EXPECT_THROW(restored(saved({9, true, 1, {1, 1, 1}})), InputError);
}

TEST(State, RefusesWhatIsForeignCutOrDamaged) {
  const std::string bytes = sample();
  EXPECT_THROW(StateReader("", "thing", 3), InputError);
  EXPECT_THROW(StateReader("SQLite format 3", "thing", 3), InputError);
  EXPECT_THROW(StateReader(bytes, "other", 3), InputError);
  EXPECT_THROW(StateReader(bytes, "thing", 4), InputError);
  EXPECT_THROW(StateReader(bytes + "x", "thing", 3), InputError);
  for (size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_THROW(StateReader(bytes.substr(0, size), "thing", 3), InputError) << size;
  }
  for (size_t i = 0; i < bytes.size(); ++i) {
    std::string damaged = bytes;
    damaged[i] ^= 0x10;
    EXPECT_THROW(StateReader(damaged, "thing", 3), InputError) << i;
  }
}

TEST(State, RefusesToReadWhatIsNotThere) {
  StateWriter w("thing", 1);
  w.reals(std::vector<double>{1, 2});
  const std::string bytes = w.finish();
  double three[3];
  EXPECT_THROW(StateReader(bytes, "thing", 1).reals(three), InputError);
  StateReader r(bytes, "thing", 1);
  EXPECT_THROW(r.finish(), InputError);
  std::vector<double> reals;
  std::string text;
  r.reals(reals);
  EXPECT_THROW(r.integer(), InputError);
  EXPECT_THROW(r.text(text), InputError);
  // A count that claims more than there is must not allocate it.
  StateWriter huge("thing", 1);
  huge.integer(UINT64_MAX / 4);
  const std::string lie = huge.finish();
  EXPECT_THROW(StateReader(lie, "thing", 1).reals(reals), InputError);
  EXPECT_THROW(StateReader(lie, "thing", 1).text(text), InputError);
}

TEST(State, RefusesNumbersOutOfTheirRange) {
  const auto reads = [](auto write, auto read) {
    StateWriter w("thing", 1);
    write(w);
    const std::string bytes = w.finish();
    StateReader r(bytes, "thing", 1);
    try {
      read(r);
      return true;
    } catch (const InputError&) {
      return false;
    }
  };
  const auto integer = [](std::uint64_t v) { return [v](StateWriter& w) { w.integer(v); }; };
  const auto real = [](double v) { return [v](StateWriter& w) { w.real(v); }; };
  const auto three = [](double v) {
    return [v](StateWriter& w) { w.reals(std::vector<double>{1, v, 2}); };
  };
  const auto in_2_5 = [](StateReader& r) {
    int value = 0;
    r.integer(value, 2, 5);
  };
  EXPECT_TRUE(reads(integer(2), in_2_5) && reads(integer(5), in_2_5));
  EXPECT_FALSE(reads(integer(6), in_2_5) || reads(integer(1), in_2_5));
  const auto boolean = [](StateReader& r) {
    bool value = false;
    r.boolean(value);
  };
  EXPECT_TRUE(reads(integer(0), boolean) && reads(integer(1), boolean));
  EXPECT_FALSE(reads(integer(2), boolean) || reads(integer(UINT64_MAX), boolean));
  const auto list = [](StateReader& r) {
    std::vector<double> values;
    r.list(values, [&](double& value) { r.real(value); });
    EXPECT_EQ(values, (std::vector<double>{1, 2}));
  };
  EXPECT_FALSE(reads(integer(1), list)) << "nothing is left";
  EXPECT_FALSE(reads(integer(UINT64_MAX), list));
  const auto two_words = [](StateWriter& w) { w.integer(2), w.real(1), w.real(2); };
  EXPECT_TRUE(reads(two_words, list));
  const auto list_of_3 = [](StateReader& r) {
    std::vector<double> values;
    r.list(values, 3, 5, [&](double& value) { r.real(value); });
  };
  EXPECT_FALSE(reads(two_words, list_of_3));
  const double most = std::numeric_limits<double>::max();
  const auto finite = [](StateReader& r) {
    double value = 0;
    r.finite(value);
  };
  EXPECT_TRUE(reads(real(most), finite) && reads(real(-most), finite));
  EXPECT_FALSE(reads(real(NAN), finite) || reads(real(kInf), finite) || reads(real(-kInf), finite));
  const auto positive = [](StateReader& r) {
    double value = 0;
    r.positive(value);
  };
  EXPECT_TRUE(reads(real(5e-324), positive) && reads(real(most), positive));
  EXPECT_FALSE(reads(real(kInf), positive));
  const auto in_1_2 = [](StateReader& r) {
    double value = 0;
    r.real(value, 1, 2);
  };
  EXPECT_TRUE(reads(real(1), in_1_2) && reads(real(2), in_1_2));
  EXPECT_FALSE(reads(real(0.99), in_1_2) || reads(real(2.01), in_1_2));
  EXPECT_FALSE(reads(real(0), positive) || reads(real(-1), positive) || reads(real(NAN), positive));
  double values[3];
  const auto all_finite = [&](StateReader& r) { r.finite(values); };
  const auto all_positive = [&](StateReader& r) { r.positive(values); };
  EXPECT_TRUE(reads(three(-3), all_finite) && reads(three(3), all_positive));
  EXPECT_FALSE(reads(three(NAN), all_finite) || reads(three(0), all_positive));
}

TEST(State, ReadsNoReasonToStopThatIsNoWord) {
  for (const auto& [reason, good] :
       {std::pair(std::string("no candidates"), true), std::pair(std::string(), false),
        std::pair(std::string("\x1b[2J"), false), std::pair(std::string("tolX"), false),
        std::pair(std::string(40, 'a'), true), std::pair(std::string(41, 'a'), false)}) {
    StateWriter w("thing", 1);
    field(w, Stop{reason, 1, 2});
    const std::string bytes = w.finish();
    StateReader r(bytes, "thing", 1);
    std::optional<Stop> stop;
    if (good) {
      field(r, stop);
      ASSERT_TRUE(stop);
      EXPECT_EQ(stop->reason, reason);
      EXPECT_EQ(stop->value, 1);
      EXPECT_EQ(stop->limit, 2);
      EXPECT_NO_THROW(r.finish());
    } else {
      EXPECT_THROW(field(r, stop), InputError);
    }
  }
}

TEST(State, SaysWhatIsLeft) {
  StateWriter w("thing", 1);
  w.integer(3);
  w.integer(4);
  const std::string bytes = w.finish();
  StateReader r(bytes, "thing", 1);
  EXPECT_EQ(r.integer(), 3u);
  try {
    r.finish();
    FAIL();
  } catch (const InputError& e) {
    EXPECT_STREQ(e.what(), "cannot restore thing: 8 bytes too many");
  }
}

TEST(State, SaysWhatIsWrong) {
  try {
    const StateReader reader(sample(), "cma-es", 1);
    FAIL();
  } catch (const InputError& e) {
    EXPECT_STREQ(e.what(), "cannot restore cma-es: the state is one of \"thing\"");
  }
}

}  // namespace
}  // namespace traceur::optim
