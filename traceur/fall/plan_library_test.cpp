// A planner's file, and the microcontroller's reader of it.
#include "traceur/fall/fall_testing.h"

namespace traceur::fall {
namespace {

/// A library of BioloidGP's plans, aligned as the reader wants it: made once, as it takes a while.
struct Compiled {
  Compiled()
      : falls(fallsOf("bioloid-gp")),
        body(modelOf(*falls), falls->setup("one_foot", "forward")),
        problem(fallProblem(body, *falls, {.poses = 2000})),
        table(problem),
        bytes(compileLibrary(problem, table, {"bioloid-gp", "one_foot", "forward"})),
        words((bytes.size() + 3) / 4) {
    std::memcpy(words.data(), bytes.data(), bytes.size());
  }
  std::shared_ptr<const FallRobot> falls;
  SagittalBody body;
  FallProblem problem;
  ValueTable table;
  std::string bytes;
  std::vector<std::uint32_t> words;

  static const Compiled& once() {
    static const Compiled kOnce;
    return kOnce;
  }
};

/// A whole library of two nodes and one edge, as small as there is.
struct TinyLibrary {
  fall_library l{};
  fall_library_node nodes[2]{};
  fall_library_edge edge{};
  float values[2][16]{};
  std::uint32_t reach = 0xffffffff;

  TinyLibrary() {
    std::memcpy(l.magic, FALL_LIBRARY_MAGIC, sizeof l.magic);
    l.version = FALL_LIBRARY_VERSION;
    l.size = sizeof *this;
    l.mass = 3;
    l.inertia = 0.03F;
    l.gravity = 9.8F;
    l.step = 0.005F;
    l.rod_speed = 0.5F;
    l.stopper_speed = 5;
    l.grid_time = 0.02F;
    l.grid_angle = 0.2F;
    l.horizon = 0.5F;
    l.rod_rates = 3;
    l.stall_stops = 1;
    l.nodes = 2;
    l.first_node = offsetof(TinyLibrary, nodes);
    for (std::uint32_t i = 0; i < 2; ++i) {
      nodes[i].first_edge = offsetof(TinyLibrary, edge);
      nodes[i].time = {0, 1.5F, 2};
      nodes[i].theta = {-1.2F, 1.57F, 2};
      nodes[i].r = {0.1F, 0.3F, 2};
      nodes[i].rate = {0, 12, 2};
      nodes[i].values = offsetof(TinyLibrary, values) + i * sizeof values[0];
    }
    nodes[0].edges = 1;
    edge = {1, 1.5F, 0.2F, 2, 8, offsetof(TinyLibrary, reach)};
    seal();
  }
  void seal() {
    constexpr size_t summed = offsetof(fall_library, problem);
    l.checksum = fall_checksum(reinterpret_cast<const char*>(this) + summed, sizeof *this - summed);
  }
  /// What opening says; what opens is planned with.
  const char* open() {
    seal();
    const fall_library* library = nullptr;
    const char* wrong = fall_open(this, sizeof *this, &library);
    for (std::uint32_t node = 0; !wrong && node <= l.nodes; ++node) {
      fall_state at{node, 0, 0.3F, 0.2F, 3};
      fall_contact contact{};
      for (int k = 0; k < 3 && fall_next(library, &at, &contact) == FALL_CONTACT; ++k) {
        at = contact.next;
      }
    }
    return wrong;
  }
};
static_assert(sizeof(TinyLibrary) % 4 == 0);

TEST(PlanLibrary, TheReaderWithoutAHeapPlansAsWell) {
  const Compiled& c = Compiled::once();
  const fall_library* library = nullptr;
  ASSERT_EQ(fall_open(c.words.data(), c.bytes.size(), &library), nullptr);
  EXPECT_LT(c.bytes.size(), 5'000'000);
  EXPECT_EQ(std::string(library->robot), "bioloid-gp");
  double read = 0;
  double planned = 0;
  int none = 0;
  for (int i = 0; i < 20; ++i) {
    const FallState start = randomStart(0.17, i);
    const FallPlan plan = planQuickly(c.problem, c.table, start, {1, 1, 1});
    fall_state at{0, 0, static_cast<float>(start.pendulum.theta),
                  static_cast<float>(start.pendulum.r),
                  static_cast<float>(start.pendulum.theta_rate)};
    fall_contact contact{};
    fall_answer answer = FALL_NONE;
    double cost = 0;
    while ((answer = fall_next(library, &at, &contact)) == FALL_CONTACT) {
      cost = std::max(cost, static_cast<double>(contact.impulse));
      at = contact.next;
    }
    if (std::isinf(plan.cost)) {
      ++none;
      continue;
    }
    EXPECT_EQ(answer, FALL_STOPS) << i;
    read += cost;
    planned += plan.cost;
  }
  EXPECT_LT(none, 5);
  EXPECT_NEAR(read, planned, 0.03 * planned);  // single precision moves a contact now and then
}

TEST(PlanLibrary, GivesBackTheTableItWasMadeFrom) {
  const Compiled& c = Compiled::once();
  const ValueTable read = tableFromLibrary(c.bytes, c.problem, "file");
  EXPECT_EQ(read.values(), c.table.values());
  const FallState start = randomStart(0.17, 3);
  EXPECT_EQ(read.at(start), c.table.at(start));
}

TEST(PlanLibrary, RefusesWhatIsNotItsOwn) {
  const Compiled& c = Compiled::once();
  const auto message = [&](const std::string& bytes, const FallProblem& problem) -> std::string {
    try {
      tableFromLibrary(bytes, problem, "a.fallplan");
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  const auto has = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_TRUE(has(message("", c.problem), "not a library"));
  EXPECT_TRUE(has(message("nonsense", c.problem), "a.fallplan: not a library"));
  EXPECT_TRUE(has(message(c.bytes.substr(0, c.bytes.size() - 4), c.problem), "another size"));
  std::string damaged = c.bytes;
  damaged.back() = static_cast<char>(damaged.back() + 1);
  EXPECT_TRUE(has(message(damaged, c.problem), "checksum"));
  std::string old = c.bytes;
  old[8] = static_cast<char>(old[8] + 1);
  EXPECT_TRUE(has(message(old, c.problem), "another version"));
  FallProblem other = c.problem;
  other.stopper_speed *= 2;
  EXPECT_TRUE(has(message(c.bytes, other), "traceur fall compile"));
}

TEST(PlanLibrary, TheReaderRefusesWhatContradictsItself) {
  ASSERT_EQ(TinyLibrary().open(), nullptr);
  const std::function<void(TinyLibrary&)> wrong[] = {
      [](TinyLibrary& t) { t.l.step = 0; },
      [](TinyLibrary& t) { t.l.step = 1e-9F; },  // would plan for hours
      [](TinyLibrary& t) { t.l.grid_angle = 1e-30F; },
      [](TinyLibrary& t) { t.l.horizon = INFINITY; },
      [](TinyLibrary& t) { t.l.gravity = NAN; },
      [](TinyLibrary& t) { t.l.grid_time = 0.001F; },  // shorter than a step: no stride
      [](TinyLibrary& t) { t.l.rod_rates = 0; },
      [](TinyLibrary& t) { t.l.nodes = 0; },
      [](TinyLibrary& t) { t.l.nodes = 50'000'000; },  // 88 times that is small in 32 bits
      [](TinyLibrary& t) { t.l.first_node += 2; },
      [](TinyLibrary& t) { t.l.first_node = 0xfffffff0; },
      [](TinyLibrary& t) { std::memset(t.l.stance, 'x', sizeof t.l.stance); },
      [](TinyLibrary& t) { std::memset(t.nodes[1].name, 'x', sizeof t.nodes[1].name); },
      [](TinyLibrary& t) { t.nodes[0].edges = 1'000'000; },
      [](TinyLibrary& t) { t.nodes[0].first_edge = sizeof t - 8; },
      [](TinyLibrary& t) { t.nodes[1].theta.n = 1; },
      [](TinyLibrary& t) { t.nodes[1].theta.n = 65536, t.nodes[1].r.n = 65536; },
      [](TinyLibrary& t) { t.nodes[1].rate.max = -1; },
      [](TinyLibrary& t) { t.nodes[1].r.min = 0; },
      [](TinyLibrary& t) { t.nodes[1].values += 4; },  // one value beyond the end
      [](TinyLibrary& t) { t.values[1][3] = NAN; },
      [](TinyLibrary& t) { t.edge.to = 2; },
      [](TinyLibrary& t) { t.edge.cell = 0; },
      [](TinyLibrary& t) { t.edge.cells = 3; },  // more bits than there are
      [](TinyLibrary& t) { t.edge.cells = 0x10000001; },
      [](TinyLibrary& t) { t.edge.reach = sizeof t; }};
  for (size_t i = 0; i < std::size(wrong); ++i) {
    TinyLibrary t;
    wrong[i](t);
    EXPECT_STREQ(t.open(), "a library of fall plans that contradicts itself") << i;
  }
}

TEST(PlanLibrary, WhateverOpensCanBePlannedWith) {
  for (size_t at = offsetof(fall_library, problem); at < sizeof(TinyLibrary); at += 4) {
    for (const std::uint32_t word : {0u, 1u, 2u, 0x7fffffffu, 0x80000000u, 0xffffffffu, 0x7fc00000u,
                                     0x7f000000u, 0xbf800000u}) {
      TinyLibrary t;
      std::memcpy(reinterpret_cast<char*>(&t) + at, &word, sizeof word);
      t.open();  // ends, and reads nothing else
    }
  }
}

TEST(PlanLibrary, TheReaderPlansNothingFromStatesThatAreNone) {
  const TinyLibrary t;
  const fall_library* library = nullptr;
  ASSERT_EQ(fall_open(&t, sizeof t, &library), nullptr);
  fall_contact contact{};
  for (const fall_state& state :
       {fall_state{2, 0, 0.3F, 0.2F, 3}, fall_state{0, NAN, 0.3F, 0.2F, 3},
        fall_state{0, 0, NAN, 0.2F, 3}, fall_state{0, 0, 0.3F, INFINITY, 3},
        fall_state{0, 0, 0.3F, 0.2F, -INFINITY}}) {
    EXPECT_EQ(fall_next(library, &state, &contact), FALL_NONE);
  }
}

TEST(PlanLibrary, TablesAreKeptWherePeopleKeepSuchThings) {
  const auto where = [](const char* cache, const char* home) {
    for (const auto& [name, value] :
         {std::pair("XDG_CACHE_HOME", cache), std::pair("HOME", home)}) {
      value ? setenv(name, value, 1) : unsetenv(name);
    }
    return tableCache().string();
  };
  const auto before = [](const char* name) {
    const char* value = std::getenv(name);
    return value ? std::optional<std::string>(value) : std::nullopt;
  };
  const auto cache = before("XDG_CACHE_HOME"), home = before("HOME");
  EXPECT_EQ(where("/c", "/h"), "/c/traceur/falls");
  EXPECT_EQ(where(nullptr, "/h"), "/h/.cache/traceur/falls");
  EXPECT_EQ(where("", "/h"), "/h/.cache/traceur/falls");
  EXPECT_EQ(where("c", "/h"), "/h/.cache/traceur/falls");
  for (const char* no_path : {static_cast<const char*>(nullptr), "", "h"}) {
    EXPECT_EQ(where(nullptr, no_path), "");
  }
  where(cache ? cache->c_str() : nullptr, home ? home->c_str() : nullptr);
}

TEST(PlanLibrary, ATableKeptOnDiskIsTheOneThatWouldBeMade) {
  const Compiled& c = Compiled::once();
  const TestFolder tables;
  const std::filesystem::path folder = tables / "fall-tables" / "deeper";
  const LibraryLabel label{"bioloid-gp", "one_foot", "forward"};
  EXPECT_EQ(cachedTable(c.problem, label, folder).values(), c.table.values());
  const auto file = std::filesystem::directory_iterator(folder)->path();
  EXPECT_EQ(cachedTable(c.problem, label, folder).values(), c.table.values());
  std::ofstream(file) << "damaged";
  EXPECT_EQ(cachedTable(c.problem, label, folder).values(), c.table.values());
  EXPECT_EQ(std::filesystem::file_size(file), c.bytes.size());
}

}  // namespace
}  // namespace traceur::fall
