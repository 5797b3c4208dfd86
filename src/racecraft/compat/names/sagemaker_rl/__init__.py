"""`sagemaker_rl`, the launchers that SageMaker's RL examples lay beside every script."""
