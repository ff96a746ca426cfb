// Under which sanitizers this is compiled: TRACEUR_SANITIZE_ADDRESS, TRACEUR_SANITIZE_THREAD. GCC
// and clang say it in ways of their own.
#pragma once

#if defined(__SANITIZE_ADDRESS__)
#define TRACEUR_SANITIZE_ADDRESS
#elif defined(__SANITIZE_THREAD__)
#define TRACEUR_SANITIZE_THREAD
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define TRACEUR_SANITIZE_ADDRESS
#elif __has_feature(thread_sanitizer)
#define TRACEUR_SANITIZE_THREAD
#endif
#endif
