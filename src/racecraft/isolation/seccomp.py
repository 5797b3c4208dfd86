"""Seccomp: a process gives up system calls that a computation does not need. Begin with `deny_calls`.

A filter of classic BPF, x86-64 and 64-bit ARM. A denied call fails with EPERM, which Python raises as a
`PermissionError` at the line that made it.
"""

from __future__ import annotations

import ctypes
import errno
import os
import platform
import struct
from collections.abc import Iterator

SET_SECCOMP, GET_SECCOMP, FILTER = 22, 21, 2
"""Of prctl: which operation, and which kind of filter."""
ARCHITECTURES = {"x86_64": (0, 0xC000003E), "aarch64": (1, 0xC00000B7)}
"""Column of `DENIED`, and the name the kernel gives a call's architecture (`linux/audit.h`)."""
X32 = 0x40000000
"""Calls of x86-64's 32-bit kind have this bit; none is needed."""

DENIED = {
    # other machines and processes
    "socket": (41, 198), "socketpair": (53, 199), "connect": (42, 203), "bind": (49, 200), "listen": (50, 201),
    "accept": (43, 202), "accept4": (288, 242), "sendto": (44, 206), "sendmsg": (46, 211), "sendmmsg": (307, 269),
    "recvfrom": (45, 207), "recvmsg": (47, 212), "recvmmsg": (299, 243),
    "shmget": (29, 194), "shmat": (30, 196), "shmctl": (31, 195), "msgget": (68, 186), "msgsnd": (69, 189),
    "msgrcv": (70, 188), "msgctl": (71, 187), "semget": (64, 190), "semop": (65, 193), "semctl": (66, 191),
    "semtimedop": (220, 192), "mq_open": (240, 180), "mq_unlink": (241, 181),
    # programs, processes, threads
    "execve": (59, 221), "execveat": (322, 281), "fork": (57, None), "vfork": (58, None),
    # signals, debugging and scheduling of other processes
    "kill": (62, 129), "tkill": (200, 130), "tgkill": (234, 131), "rt_sigqueueinfo": (129, 138),
    "rt_tgsigqueueinfo": (297, 240), "pidfd_open": (434, 434), "pidfd_send_signal": (424, 424),
    "pidfd_getfd": (438, 438), "ptrace": (101, 117), "process_vm_readv": (310, 270), "process_vm_writev": (311, 271),
    "process_madvise": (440, 440), "process_mrelease": (448, 448), "kcmp": (312, 272), "setpriority": (141, 140),
    "ioprio_set": (251, 30), "sched_setaffinity": (203, 122), "sched_setparam": (142, 118),
    "sched_setscheduler": (144, 119), "sched_setattr": (314, 274), "migrate_pages": (256, 238),
    "move_pages": (279, 239),
    # memory that no limit counts
    "memfd_create": (319, 279), "memfd_secret": (447, 447),
    # what Landlock leaves open: modes, owners, times and attributes of files, and their length before ABI 3
    "chmod": (90, None), "fchmod": (91, 52), "fchmodat": (268, 53), "fchmodat2": (452, 452), "chown": (92, None),
    "fchown": (93, 55), "lchown": (94, None), "fchownat": (260, 54), "utime": (132, None), "utimes": (235, None),
    "utimensat": (280, 88), "futimesat": (261, None), "setxattr": (188, 5), "lsetxattr": (189, 6),
    "fsetxattr": (190, 7), "removexattr": (197, 14), "lremovexattr": (198, 15), "fremovexattr": (199, 16),
    "truncate": (76, 45),
    # the kernel's own
    "unshare": (272, 97), "setns": (308, 268), "mount": (165, 40), "umount2": (166, 39), "pivot_root": (155, 41),
    "chroot": (161, 51), "open_tree": (428, 428), "move_mount": (429, 429), "fsopen": (430, 430),
    "fsconfig": (431, 431), "fsmount": (432, 432), "fspick": (433, 433), "mount_setattr": (442, 442),
    "name_to_handle_at": (303, 264), "open_by_handle_at": (304, 265), "fanotify_init": (300, 262),
    "quotactl": (179, 60), "quotactl_fd": (443, 443), "acct": (163, 89), "swapon": (167, 224), "swapoff": (168, 225),
    "reboot": (169, 142), "sethostname": (170, 161), "setdomainname": (171, 162), "settimeofday": (164, 170),
    "clock_settime": (227, 112), "adjtimex": (159, 171), "clock_adjtime": (305, 266), "init_module": (175, 105),
    "finit_module": (313, 273), "delete_module": (176, 106), "kexec_load": (246, 104), "kexec_file_load": (320, 294),
    "iopl": (172, None), "ioperm": (173, None), "personality": (135, 92), "bpf": (321, 280),
    "perf_event_open": (298, 241), "userfaultfd": (323, 282), "io_uring_setup": (425, 425),
    "io_uring_enter": (426, 426), "io_uring_register": (427, 427), "keyctl": (250, 219), "add_key": (248, 217),
    "request_key": (249, 218),
}  # fmt: skip
"""System calls that fail, with their numbers on x86-64 and on ARM (None: it has no such call)."""
CLONE3 = (435, 435)
"""Fails as unknown, so that the C library tries `clone`, whose flags a filter can see."""
CLONE, NEW_THREAD = (56, 220), 0x10000
"""Denied, but for threads of the process itself where it may have some: they are held to the same filter."""
FCNTL, OWNER_COMMANDS = (72, 25), (8, 10, 15)
"""F_SETOWN, F_SETSIG, F_SETOWN_EX: they send signals to other processes."""
MMAP, SHARED_ANONYMOUS = (9, 222), 0x21
"""Shared memory without a file: RLIMIT_DATA does not count it."""
PRLIMIT64 = (302, 261)
"""Of the process itself only."""

LOAD, JUMP_EQUAL, JUMP_AT_LEAST, AND, RETURN = 0x20, 0x15, 0x35, 0x54, 0x06
ALLOW, KILL_PROCESS, FAIL = 0x7FFF0000, 0x80000000, 0x00050000
CALL_AT, ARCHITECTURE_AT, ARGUMENTS_AT = 0, 4, 16
"""Where `struct seccomp_data` holds them; an argument is 8 bytes, its low half first on both architectures."""


def is_available() -> bool:
    """Tell whether this kernel filters system calls, and the table knows this architecture."""
    return platform.machine() in ARCHITECTURES and int(ctypes.CDLL(None).prctl(GET_SECCOMP, 0, 0, 0, 0)) == 0


def deny_calls(threads: bool = False) -> bool:
    """Let the calling thread make none of the calls in `DENIED` from now on; it must have no other threads.

    The process must have given up new privileges before (`layers.py`).

    Args:
        threads: It may start threads of its own from now on.

    Returns:
        Whether the filter is in force; False: this kernel or architecture has none.
    """
    if platform.machine() not in ARCHITECTURES:
        return False
    program = b"".join(_program(*ARCHITECTURES[platform.machine()], threads))
    code = ctypes.create_string_buffer(program, len(program))
    packed = struct.pack("@HP", len(program) // 8, ctypes.addressof(code))
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(SET_SECCOMP, FILTER, packed, 0, 0) == 0:
        return True
    number = ctypes.get_errno()
    if number in (errno.EINVAL, errno.ENOSYS):
        return False
    raise OSError(number, os.strerror(number))


def _program(column: int, architecture: int, threads: bool) -> Iterator[bytes]:
    """Yield the filter's instructions: `struct sock_filter`, 8 bytes each."""
    denied = _return(FAIL | errno.EPERM)
    yield _do(LOAD, ARCHITECTURE_AT)
    yield from _if(JUMP_EQUAL, architecture, otherwise=_return(KILL_PROCESS))
    yield _do(LOAD, CALL_AT)
    if column == 0:
        yield from _if(JUMP_AT_LEAST, X32, then=denied)
    for numbers in DENIED.values():
        if (number := numbers[column]) is not None:
            yield from _if(JUMP_EQUAL, number, then=denied)
    yield from _if(JUMP_EQUAL, CLONE3[column], then=_return(FAIL | errno.ENOSYS))
    flags = (_do(LOAD, _argument(0)), _do(AND, NEW_THREAD))
    thread = _if(JUMP_EQUAL, NEW_THREAD, otherwise=denied) if threads else (denied,)
    yield from _in_call(CLONE[column], *flags, *thread)
    commands = [part for command in OWNER_COMMANDS for part in _if(JUMP_EQUAL, command, then=denied)]
    yield from _in_call(FCNTL[column], _do(LOAD, _argument(1)), *commands)
    masked = (_do(LOAD, _argument(3)), _do(AND, SHARED_ANONYMOUS))
    yield from _in_call(MMAP[column], *masked, *_if(JUMP_EQUAL, SHARED_ANONYMOUS, then=denied))
    yield from _in_call(PRLIMIT64[column], _do(LOAD, _argument(0)), *_if(JUMP_EQUAL, 0, otherwise=denied))
    yield _return(ALLOW)


def _argument(number: int) -> int:
    return ARGUMENTS_AT + 8 * number


def _do(operation: int, value: int, equal: int = 0, other: int = 0) -> bytes:
    return struct.pack("=HBBI", operation, equal, other, value)


def _return(value: int) -> bytes:
    return _do(RETURN, value)


def _if(test: int, value: int, then: bytes = b"", otherwise: bytes = b"") -> Iterator[bytes]:
    """Yield a test and what is done where it holds, or where it does not; one instruction, and it returns."""
    yield _do(test, value, equal=0 if then else 1, other=1 if then else 0)
    yield then or otherwise


def _in_call(number: int, *instructions: bytes) -> Iterator[bytes]:
    """Yield what is looked at in one call only; the call is then allowed."""
    yield _do(JUMP_EQUAL, number, equal=0, other=len(instructions) + 1)
    yield from instructions
    yield _return(ALLOW)
