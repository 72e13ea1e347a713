/** Runs a task whenever that is requested: once at a time, and once more after the last request during a run. */
export class Latest {
  private run?: { again: boolean };

  /** The task is told whether another run follows. */
  constructor(private readonly task: (isOutdated: () => boolean) => Promise<void>) {}

  /** Runs the task, or has it run again when it ends. */
  async request(): Promise<void> {
    if (this.run !== undefined) {
      this.run.again = true;
      return;
    }
    const run = { again: false };
    this.run = run;
    do {
      run.again = false;
      await this.task(() => run.again || this.run !== run);
    } while (run.again && this.run === run);
    if (this.run === run) {
      this.run = undefined;
    }
  }

  /** Gives up waiting for a run that may never end. */
  abandon(): void {
    this.run = undefined;
  }
}
