"""What becomes of each kind of resource on one machine. Begin with `reason_for`."""

from __future__ import annotations

BUCKET = "AWS::S3::Bucket"
NOTEBOOK = "AWS::SageMaker::NotebookInstance"
START_SCRIPTS = "AWS::SageMaker::NotebookInstanceLifecycleConfig"
STACK = "AWS::CloudFormation::Stack"
ROLE_TYPE = "AWS::IAM::Role"

_SERVE = "`racecraft serve RUN` answers /ping and /invocations"
_SNAKES = "`racecraft snakes serve` answers HTTP itself"
_NETWORK = "a network of the cloud; everything talks on this machine"
_JOBS = "trainings and services are processes of this machine (`racecraft jobs`)"
_LOGS = "every job's log and every run's metrics stand in its folder"
_CODE = "code that AWS would call; nothing in a template is run"
_RIGHTS = "nobody is asked for permission on this machine"

REASONS = {
    "AWS::IAM::": _RIGHTS,
    "AWS::Cognito::": _RIGHTS,
    "AWS::EC2::Instance": "a machine to rent; this one is used",
    "AWS::EC2::LaunchTemplate": "a machine to rent; this one is used",
    "AWS::AutoScaling::": "machines to rent; this one is used",
    "AWS::EC2::": _NETWORK,
    "AWS::ElasticLoadBalancing": _NETWORK,
    "AWS::Route53::": _NETWORK,
    "AWS::CloudFront::": _NETWORK,
    "AWS::EFS::": "a disk to rent; folders of this machine are used",
    "AWS::S3::BucketPolicy": _RIGHTS,
    "AWS::S3::": "a bucket is a plain folder here",
    "AWS::SageMaker::Model": _SERVE,
    "AWS::SageMaker::Endpoint": _SERVE,
    "AWS::SageMaker::CodeRepository": "clone it into the notebook's folder yourself",
    "AWS::SageMaker::": "no such service of SageMaker's is here",
    "AWS::RoboMaker::": "`racecraft train` has the simulation inside",
    "AWS::Lambda::": _CODE,
    "AWS::CloudFormation::CustomResource": _CODE,
    "Custom::": _CODE,
    "AWS::ApiGateway": _SNAKES,
    "AWS::ECS::": _JOBS,
    "AWS::ECR::": "no container is needed",
    "AWS::Batch::": _JOBS,
    "AWS::StepFunctions::": _JOBS,
    "AWS::Events::": _JOBS,
    "AWS::Logs::": _LOGS,
    "AWS::CloudWatch::": _LOGS,
    "AWS::KMS::": "folders are not encrypted",
    "AWS::SecretsManager::": "no secret of AWS's is needed",
    "AWS::SSM::": "settings stand in files and on the command line",
    "AWS::DynamoDB::": "no database is made; racecraft keeps files and a store of jobs",
    "AWS::RDS::": "no database is made; RACECRAFT_JOB_STORE names one of yours",
    "AWS::Kinesis": "no stream is made; `racecraft watch` shows a run while it trains",
    "AWS::SNS::": "nobody is sent messages",
    "AWS::SQS::": "`racecraft jobs` keeps the queue",
    "AWS::CloudFormation::": "waits for nothing here",
}
"""Beginning of a type's name → why nothing is made; the longest beginning counts."""
UNKNOWN = "racecraft has nothing that stands for it"


def reason_for(kind: str) -> str:
    """Return why nothing is made of a resource of this type.

    >>> reason_for("AWS::EC2::Subnet")
    'a network of the cloud; everything talks on this machine'
    >>> reason_for("AWS::Quantum::Gate")
    'racecraft has nothing that stands for it'
    """
    fitting = [beginning for beginning in REASONS if kind.startswith(beginning)]
    return REASONS[max(fitting, key=len)] if fitting else UNKNOWN
