/* User-Mode Linux 6.1 keeps 2,696 bytes of a process's extended registers, and the kernel takes them back only whole: on processors
 * that have more (AMX: 11 kB) its first process ends at once, in put_fp_registers. Preloaded into linux.uml by tools/vcan, this
 * hands the kernel the whole: what UML keeps, and behind it what the process has there (nothing, unless it asked for AMX). */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <string.h>
#include <sys/uio.h>

enum { GETREGSET = 0x4204, SETREGSET = 0x4205 };

long ptrace(long request, int pid, void *address, void *data) {
    static __thread char whole[1 << 16];
    long (*kernels)(long, int, void *, void *) = (long (*)(long, int, void *, void *))dlsym(RTLD_NEXT, "ptrace");
    struct iovec *given = data, all = {whole, sizeof whole};
    if (request == SETREGSET && (long)address == NT_X86_XSTATE &&
        kernels(GETREGSET, pid, address, &all) == 0 && given->iov_len < all.iov_len) {
        memcpy(whole, given->iov_base, given->iov_len);
        data = &all;
    }
    return kernels(request, pid, address, data);
}
