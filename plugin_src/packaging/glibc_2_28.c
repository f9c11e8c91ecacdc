// What g++ 12's own libraries ask of a C library later than 2.28, for the portable library and program alone. Nothing
// here is seen from outside.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <link.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/random.h>
#include <time.h>

#define HIDDEN __attribute__((visibility("hidden")))

// 2.32: whether libstdc++ may count references without atomics. The host has threads.
HIDDEN char __libc_single_threaded = 0;

// 2.36: std::random_device.
HIDDEN uint32_t arc4random(void) {
    uint32_t word;
    while (getrandom(&word, sizeof word, 0) != sizeof word)
        if (errno != EINTR) abort();
    return word;
}

// 2.30: std::condition_variable until a time of the steady clock. The wall clock's leaps make it end early or late
// once; libstdc++ looks at the steady clock again.
HIDDEN int pthread_cond_clockwait(pthread_cond_t* condition, pthread_mutex_t* mutex, clockid_t clock,
                                  const struct timespec* until) {
    if (clock == CLOCK_REALTIME) return pthread_cond_timedwait(condition, mutex, until);
    struct timespec now, wall;
    clock_gettime(clock, &now);
    clock_gettime(CLOCK_REALTIME, &wall);
    wall.tv_sec += until->tv_sec - now.tv_sec;
    wall.tv_nsec += until->tv_nsec - now.tv_nsec;
    if (wall.tv_nsec < 0) wall.tv_nsec += 1000000000, --wall.tv_sec;
    if (wall.tv_nsec >= 1000000000) wall.tv_nsec -= 1000000000, ++wall.tv_sec;
    return pthread_cond_timedwait(condition, mutex, &wall);
}

// 2.35: which object an address is in, and where its unwinding tables are; libgcc asks for each frame that an exception
// passes. CGAL throws often: the system's own is used where it has one, as it takes no lock.
typedef int Find(void*, struct dl_find_object*);
static _Atomic(Find*) find_of_system;

struct Search {
    uintptr_t address;
    struct dl_find_object* found;
};

static int look(struct dl_phdr_info* object, size_t size, void* data) {
    (void)size;
    struct Search* search = data;
    const ElfW(Phdr)* tables = NULL;
    uintptr_t begin = UINTPTR_MAX, end = 0;
    int is_inside = 0;
    for (int i = 0; i < object->dlpi_phnum; ++i) {
        const ElfW(Phdr)* part = &object->dlpi_phdr[i];
        const uintptr_t from = object->dlpi_addr + part->p_vaddr, to = from + part->p_memsz;
        if (part->p_type == PT_GNU_EH_FRAME) tables = part;
        if (part->p_type != PT_LOAD) continue;
        if (search->address >= from && search->address < to) is_inside = 1;
        if (from < begin) begin = from;
        if (to > end) end = to;
    }
    if (!is_inside || !tables) return is_inside;
    *search->found = (struct dl_find_object){.dlfo_map_start = (void*)begin,
                                             .dlfo_map_end = (void*)end,
                                             .dlfo_eh_frame = (void*)(object->dlpi_addr + tables->p_vaddr)};
    return 1;
}

static int find_by_looking(void* address, struct dl_find_object* found) {
    struct Search search = {(uintptr_t)address, found};
    found->dlfo_eh_frame = NULL;
    dl_iterate_phdr(look, &search);
    return found->dlfo_eh_frame ? 0 : -1;
}

HIDDEN int _dl_find_object(void* address, struct dl_find_object* found) {
    Find* find = atomic_load_explicit(&find_of_system, memory_order_relaxed);
    if (!find) {
        find = (Find*)dlsym(RTLD_DEFAULT, "_dl_find_object");
        if (!find) find = find_by_looking;
        atomic_store_explicit(&find_of_system, find, memory_order_relaxed);
    }
    return find(address, found);
}
