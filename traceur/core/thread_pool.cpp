#include "traceur/core/thread_pool.h"

#include <algorithm>
#include <cassert>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace traceur {

struct ThreadPool::State {
  std::mutex mutex;
  std::condition_variable_any start;
  std::condition_variable done;
  const std::function<void(int)>* work = nullptr;
  int n = 0;
  int next = 0;
  int running = 0;
  int failed_at = -1;
  std::exception_ptr failure;
  std::vector<std::jthread> workers;

  /// Takes indices until none are left. Called with the lock held; releases it around the work.
  void drain(std::unique_lock<std::mutex>& lock) {
    while (next < n) {
      const int i = next++;
      ++running;
      lock.unlock();
      std::exception_ptr error;
      try {
        (*work)(i);
      } catch (...) {
        error = std::current_exception();
      }
      lock.lock();
      --running;
      if (error && (failed_at < 0 || i < failed_at)) {
        failed_at = i;
        failure = error;
      }
    }
  }
};

ThreadPool::ThreadPool(int threads) : state_(std::make_unique<State>()) {
  if (threads <= 0) threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  State& s = *state_;
  for (int t = 1; t < threads; ++t) {
    s.workers.emplace_back([&s](const std::stop_token& stop) {
      std::unique_lock lock(s.mutex);
      while (s.start.wait(lock, stop, [&s] { return s.next < s.n; })) {
        s.drain(lock);
        if (s.running == 0) s.done.notify_all();
      }
    });
  }
}

ThreadPool::~ThreadPool() {
  for (std::jthread& w : state_->workers) w.request_stop();
}

int ThreadPool::threads() const {
  return static_cast<int>(state_->workers.size()) + 1;
}

void ThreadPool::forEach(int n, const std::function<void(int)>& work) {
  State& s = *state_;
  std::unique_lock lock(s.mutex);
  assert(s.running == 0 && "forEach is not reentrant");
  s.work = &work;
  s.next = 0;
  s.n = n;
  s.failed_at = -1;
  s.failure = nullptr;
  s.start.notify_all();
  s.drain(lock);
  s.done.wait(lock, [&s] { return s.running == 0; });
  s.n = s.next = 0;
  if (s.failure) std::rethrow_exception(s.failure);
}

}  // namespace traceur
