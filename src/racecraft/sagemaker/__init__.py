"""SageMaker's names and files: estimator, sessions, containers, endpoints, CloudFormation."""
